"""Options of the public listener's process. Any thread."""

from protocol.access.roles import checked_roles
from protocol.keys import DEFAULT_ROUTER
from protocol.session import Public
from realtime.service_options import ServiceOptions


class AccessOptions(ServiceOptions, frozen=True, kw_only=True):
    """connect: the gateway's own router, on loopback; public: the listener for other machines."""

    public: Public
    connect: str = DEFAULT_ROUTER

    def __post_init__(self) -> None:
        checked_roles(self.public.roles)
