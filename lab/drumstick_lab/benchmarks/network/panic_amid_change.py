"""PANIC at random instants of changes of scene: drumstick lab panic-amid-change [--changes 50].

A rig on loopback, by OSC: another scene is asked for, and at a random instant of the change `/drumstick/panic` is sent,
four times in five about the handover from one servo to the next. It counts from before the datagram is sent, so the
way to the gateway is in it. Either the servo that plays tells panic in a state: these come every 33 ms, so the tick
that acted was up to 33 ms earlier. Or it has ended, and the next one is held from its first tick on: then the last sign
of a force is stored, a strike or a state of one that plays, and how long it takes until a state tells panic, for which
the next gateway has to be up. In both cases none may strike before `arm`. By the servo's clock, which is this machine's.
"""

import argparse
import json
import random
import statistics
import time
from typing import Any

from osc_port import OscPort
from rig_process import Listener, Rig, running, wait_for
from settled import settled

from drumstick_lab.measuring import stored
from haptic_server import files
from protocol.messages import State, Strike
from rig.folder import run_folder
from rig.supervision.arm import arm

GOAL_MS = 100.0
SCENES = ("tom", "roll")  # by turns; the rig starts with the last
WAYS = ("the servo that played", "the next from its start")
_AFTERWARDS_TICKS = 300
PATIENCE_S = 600.0  # a busy machine starts a rig in minutes; whoever waits, waits for an event


def held(rig: Rig, states: Listener[State]) -> tuple[set[int], bool]:
    """Servos that ticked until the change was over, and whether each told of the panic only."""
    boots: set[int] = set()
    while True:  # the next servo may have had its turn already, and be held from its start on
        after = settled(rig, states, PATIENCE_S)
        if after.status != "panic":
            return boots | {after.boot}, False
        boots.add(after.boot)
        wait_for(
            "some ticks more, or another servo",
            lambda s=after: (
                states.got[-1].boot != s.boot or states.got[-1].ticks > s.ticks + _AFTERWARDS_TICKS
            ),
            PATIENCE_S,
        )
        if states.got[-1].boot == after.boot:
            return boots, settled(rig, states, PATIENCE_S).status == "panic"


def one(
    rig: Rig,
    osc: OscPort,
    states: Listener[State],
    strikes: Listener[Strike],
    change: int,
    chance: random.Random,
) -> dict[str, Any]:
    """One change with a panic in it; the rig plays again at the end."""
    boot = settled(rig, states, PATIENCE_S).boot
    osc.send("/drumstick/scene/load", SCENES[change % 2])
    about_handover = bool(change % 5)
    if about_handover:
        ready = run_folder(rig.name) / files.NEXT / files.SERVO_READY
        wait_for("the handover", lambda: ready.exists() or states.got[-1].boot != boot, PATIENCE_S)
    time.sleep(chance.uniform(0.0, 0.3))
    before, seen = len(strikes.got), len(states.got)
    sent_ns = time.monotonic_ns()
    osc.send("/drumstick/panic")
    first = wait_for(
        "the panic",
        lambda: next((s for s in list(states.got[seen:]) if s.status == "panic" and s.t_ns > sent_ns), None),
        PATIENCE_S,
    )
    signs = [s.t_ns for s in list(states.got[seen:]) if s.status == "playing" and s.ticks > 0]
    if first.t_ns - sent_ns > 1_000_000_000:
        print(rig.said[-2000:], flush=True)  # whatever held it up is told there
    boots, kept = held(rig, states)
    struck = [s.t_ns for s in strikes.got[before:] if s.t_ns > sent_ns]
    arm(rig.name)
    armed = len(strikes.got)
    wait_for("strikes again", lambda: len(strikes.got) > armed, PATIENCE_S)
    wait_for("the panic's end", lambda: states.got[-1].status != "panic", PATIENCE_S)
    return {
        "told_ms": (first.t_ns - sent_ns) * 1e-6,
        "by": WAYS[first.boot != boot],
        "last_force_ms": max(((t - sent_ns) * 1e-6 for t in (*struck, *signs) if t > sent_ns), default=0.0),
        "struck_later": any(t > first.t_ns for t in struck),
        "held": kept,
        "servos": len(boots | {boot}),
        "about_handover": about_handover,
    }


def measured(changes: int) -> dict[str, Any]:
    """Distribution over all changes."""
    chance, rows = random.Random(23), list[dict[str, Any]]()
    with running("haptic", "--scene", SCENES[-1]) as rig:
        session = rig.client(PATIENCE_S)
        states = Listener(session, rig.keys.state, State)
        strikes = Listener(session, rig.keys.strike, Strike)
        wait_for("strikes and a state", lambda: strikes.got and states.got, PATIENCE_S)
        with OscPort(rig.osc_out, rig.osc_in) as osc:
            for change in range(changes):
                rows.append(one(rig, osc, states, strikes, change, chance))
                print(change, rows[-1], flush=True)
        session.close()  # type: ignore[no-untyped-call]
    by = {which: sorted(row["told_ms"] for row in rows if row["by"] == which) for which in WAYS}
    return {
        "changes": changes,
        "about_handover": sum(row["about_handover"] for row in rows),
        "another_servo_in": sum(row["servos"] > 1 for row in rows),
        "goal_ms": GOAL_MS,
        "held_in": sum(row["held"] and not row["struck_later"] for row in rows),
        "within_goal": sum(
            (row["told_ms"] if row["by"] == WAYS[0] else row["last_force_ms"]) <= GOAL_MS for row in rows
        ),
        "last_force_worst_ms": max(row["last_force_ms"] for row in rows),
        "rows_ms": {
            which: {
                "count": len(told),
                "p50": statistics.median(told),
                "worst": told[-1],
                "all": [round(each, 2) for each in told],
            }
            for which, told in by.items()
            if told
        },
    }


def main() -> None:
    """Measure, tell and store."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--changes", type=int, default=50)
    found = measured(parser.parse_args().changes)
    stored.store("panic_amid_change", found)
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
