"""`drumstick arm`: clears a panic or a fault. Only here, on the haptic machine: it writes to the servo's own block."""

from rig import folder
from rig.fault import lacking


def arm(rig: str) -> None:
    """Let the servo play again. Raises Stop when no servo of that rig runs on this machine."""
    from drumstick.law import law_of
    from drumstick.scene import parse
    from haptic_server import block, files
    from realtime.atomics import poke

    run = folder.run_folder(rig)
    try:
        scene = parse((run / files.SCENE).read_text(encoding="utf-8"), files.SCENE)
        mapped = block.attach(run, law_of(scene).dtype)
    except FileNotFoundError:
        lacking(f"no servo of rig {rig!r} runs on this machine")
    except block.BlockError as error:
        lacking(str(error))
    poke(mapped.control, block.ARM, 1)
    print("armed: the stick is thrown again")
