"""Asking a router at once whether it lets us in, before a process is started that would only be refused."""

from rig.exit_status import unavailable
from rig.supervision.parts import HAPTIC
from rig.supervision.plan import Options


def require_admission(options: Options) -> None:
    """Stop where the far router refuses this certificate; one that is not there yet is waited for later.

    The force loop is started whatever a router says; its gateway tells, and tries again.
    """
    if options.identity is None or options.connect is None or HAPTIC in options.parts:
        return
    from protocol.access.handshake import why_refused

    why = why_refused(options.connect, options.identity)
    if why is not None and why.somebody_is_there:
        unavailable(why.words)
