"""`drumstick arm`: clears a panic or a fault. Only here, on the haptic machine: it writes to the servo's own block."""

import time

from rig import folder
from rig.exit_status import unavailable

_PATIENCE_S = 1.0  # a servo that has just been started, or a machine that is busy


def arm(rig: str) -> None:
    """Let the servo play again. Raises CommandError when no servo of that rig ticks on this machine."""
    from haptic_server import block_header
    from realtime.atomics import poke

    try:
        found = block_header.read_header(folder.run_folder(rig))
    except block_header.BlockError as error:
        unavailable(str(error))
    if found is None:
        unavailable(
            f"no servo of rig {rig!r} runs on this machine under this account; as a systemd service: "
            f"sudo drumstick-at {rig} arm"
        )
    until = time.monotonic() + _PATIENCE_S
    while not block_header.is_alive(found.control):
        # One that is dead would never see it, and the one after it starts held where this one was.
        if time.monotonic() > until:
            unavailable(f"the servo of rig {rig!r} does not tick: arm again when it does")
        time.sleep(0.02)
    poke(found.control, block_header.ARM, 1)
    print("armed: the stick is thrown again")
