"""Writes docs/permission.md from the table of haptic_server.permission: drumstick lab permission-page."""

from drumstick_lab.checkout import DOCS
from haptic_server.permission import EVENTS, MAY_PUSH, REFUSED, STATES

PAGE = DOCS / "permission.md"

_INTRODUCTION = """\
# Permission to push

Made by `drumstick lab permission-page` from the table in `services/haptic_server/permission.py`; do not edit.

A motor pushes somebody's hand only while the servo is *free*. A panic or a fault takes the permission away from the next tick on (a fault that the tick itself finds: on that tick).

## What clears a panic or a fault

| what happens | is the servo free again? |
|---|---|
| `drumstick arm`, typed on the haptic machine by the user who started the rig; where the rig runs as systemd services: `sudo drumstick-at main arm` | yes |
| `drumstick up` or `drumstick haptic` is ended and typed anew, or there is a new container | yes: that is a new rig |
| the haptic machine is booted again | yes |
| a process of the rig dies or hangs, and `drumstick up` or systemd starts it again | no |
| the systemd services are restarted, or updated | no |

## The whole table
"""

_REST = """\
A state in italics is the one before: nothing changes. Sets of parameters are accepted in every
state; without permission no force results. A strike that is played without the stick ([osc.md](osc.md)) is not in the table: it sounds
in every state, whoever holds the lock, since it moves no arm and changes no parameter.

Panics are counted, so that none is lost to an `arm` command that came before it; where both meet in one tick, the panic wins. A fault
discards any `arm` command given before the fault was reported.

## Over restarts

The servo writes into its block (a file in memory) whether it is held (by a panic or a fault), before it writes that it has seen a
panic. A new servo starts held. Once its block has replaced the old one under the same name, it takes over the state last written in the
old one. A gateway that has written a panic into a block looks whether that block is still the one in place; if not, it writes the panic
into the new one too. So one of the two sees the other, and whichever is killed, at whatever instant, nothing is lost. The part of the
block that this needs is the same in every version and for every scene; a damaged block counts as held.

## What is proved, and how

`tests/model/permission.pml` is a model of servo, gateway, supervisor and the person who arms, made from this table.
`spin` goes through all of its states, with every process killed before each of its steps as often as one likes: in none
is there force in a tick that began after a panic or a fault, without an arm since. The same search finds the mistake when
any one precaution is taken out of the model (`tests/model/test_permission_model.py`). Every cell of the table is tried on the
compiled tick, for the simulated stick and for a sampled device (`tests/unit/haptic_server/test_permission.py`), and on real processes that are stopped and
killed (`tests/system/test_permission_holds.py`).

A panic has happened when the gateway has written it down, a fault when the servo has. A packet that the gateway has not
read when it is killed, or a fault in the very microsecond in which the servo dies, was reported to nobody. A panic takes
effect with the first tick that begins after it was written.
"""


def _cell(before: int, then: int) -> str:
    if then == REFUSED:
        return "refused"
    return f"*{STATES[then]}*" if then == before else STATES[then]


def page() -> str:
    """The whole page."""
    lines = [
        _INTRODUCTION,
        "| state | force |",
        "|---|---|",
        *(f"| {state} | {'yes' if may else 'none'} |" for state, may in zip(STATES, MAY_PUSH, strict=True)),
        "",
        f"| what happens | who may cause it | {' | '.join(f'when {state}' for state in STATES)} | while another client holds the tuning lock |",
        "|" + "---|" * (len(STATES) + 3),
        *(
            f"| {row.name} | {row.cause} | {' | '.join(_cell(*pair) for pair in enumerate(row.then))} |"
            f" {'works' if row.beside_lease else 'refused'} |"
            for row in EVENTS
        ),
        "",
        _REST,
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
