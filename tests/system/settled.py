"""End of a change of scene, for whoever starts another one or presses PANIC amid it."""

from rig_process import Listener, Rig, wait_for

from protocol.messages import State


def settled(rig: Rig, states: Listener[State], patience_s: float = 180.0) -> State:
    """Wait until one servo ticks and no other scene is due; its newest state.

    Neither a scene that is made ready, nor a servo that has still to tick, nor one that a busy machine holds up so long
    that the gateway says so in place of what it last knew.
    """

    def newest() -> State | None:
        state = states.got[-1]
        ticks = state.ticks > 0 and "does not tick" not in state.status
        return state if ticks and not state.next_scene else None

    return wait_for(
        "the end of the change", lambda: newest() if rig.process.poll() is None else None, patience_s
    )
