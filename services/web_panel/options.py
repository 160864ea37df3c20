"""Options of the panel's process. Any thread."""

from pathlib import Path
from typing import Annotated

from msgspec import Meta

from protocol.access.identity import Identity
from protocol.keys import DEFAULT_RIG, DEFAULT_ROUTER, checked_rig
from realtime.service_options import ServiceOptions


class LanOptions(ServiceOptions, frozen=True, kw_only=True):
    """Address and certificate of the page on the network. in_terminal: the login link is also drawn, for a camera."""

    host: str
    port: Annotated[int, Meta(ge=1, le=65535)]
    certificate: Path
    private_key: Path
    in_terminal: bool = False


class PanelOptions(ServiceOptions, frozen=True, kw_only=True):
    """port 0: any free one. token_file: made when missing; undo is kept beside it.

    accuracy_shipped, accuracy_own: results of `drumstick accuracy`, for comparison, and of this machine. lan: None, and
    the page is on 127.0.0.1 alone.
    """

    token_file: Path
    rig: str = DEFAULT_RIG
    connect: str = DEFAULT_ROUTER
    identity: Identity | None = None
    port: Annotated[int, Meta(ge=0, le=65535)] = 8080
    accuracy_shipped: Path | None = None
    accuracy_own: Path | None = None
    lan: LanOptions | None = None

    def __post_init__(self) -> None:
        checked_rig(self.rig)
