"""Writes permission.pml, which spin searches exhaustively: python tests/model/permission_model.py.

States, events and what follows come from haptic_server.permission; the processes around them, step by step as servo,
gateway, supervisor and operator take them, stand in processes.pml. A step is what no other process can see half done.
"""

from pathlib import Path

from haptic_server.permission import ARM, EVENTS, FAULT, MAY_PUSH, PANIC, SERVO, STATES, after

FOLDER = Path(__file__).parent
MODEL = FOLDER / "permission.pml"
_PROCESSES = FOLDER / "processes.pml"
# The events that the processes name. The others leave the permission alone, or are no step of their own: a gateway that
# starts anew is the process that begins again, another scene is laid out by a supervisor.
_NAMED = {"PANIC": PANIC, "FAULT": FAULT, "ARM": ARM, "SERVO": SERVO}


def _by_state(name: str, values: list[int]) -> str:
    last = len(values) - 1
    tests = "".join(f"(s) == {state} -> {value} : (" for state, value in enumerate(values[:last]))
    return f"#define {name}(s) ({tests}{values[last]}{')' * last})"


def _event(name: str, event: int) -> str:
    rule = _by_state(f"AFTER_{name}", [after(state, event) for state in range(len(STATES))])
    return f"{rule} /* {EVENTS[event].name} */"


def model() -> str:
    """The whole text."""
    lines = [
        "/* Made by tests/model/permission_model.py from haptic_server.permission and processes.pml; do not edit. */",
        "",
        *(f"#define {state.upper()} {number}" for number, state in enumerate(STATES)),
        _by_state("MAY_PUSH", [int(allowed) for allowed in MAY_PUSH]),
        *(_event(name, event) for name, event in _NAMED.items()),
        "",
    ]
    return "\n".join(lines) + "\n" + _PROCESSES.read_text(encoding="utf-8")


if __name__ == "__main__":
    MODEL.write_text(model(), encoding="utf-8")
