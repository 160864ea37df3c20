"""Search for an accepted set on which a held arm does not come to rest: drumstick lab held-arm [--sets 1000000 --seed 1].

Sets of parameters for a sampled arm (stiffness, damping, mass, hand, rate, delay, predictor, friction, release) are
drawn at random, half of them moved to within 2 % of the boundary of what the envelope accepts, by r_in or by k_coll.
Each accepted one is played by the very tick that plays, in virtual time, with a change to another accepted set on the
way, and judged by tests/arm_witness.py, which knows nothing of envelope or guard. Half the sets are played without the
guard's energy account, so that the envelope is judged alone.

The search goes on from where it was stopped as long as the text that it judges is the same; --minutes bounds a part.

`--known` plays the sets that hammered for ever before 2026-11-23, when a damper was bounded from one side only; they
are refused now, and the guard alone is shown with them. Results go to lab/results/held_arm.json.
"""

import argparse
import datetime
import hashlib
import inspect
import json
import math
import multiprocessing
import os
import time
from typing import Any

import numpy as np

import arm_witness
import held_arms
import live_sets
from drumstick.safety import bounds, contact_bounds, entry_speed, envelope, sampled_contact
from drumstick.scenes.table import Refusal
from drumstick.stick.law import law_of
from drumstick_lab.guard_version import guard_version
from drumstick_lab.measuring import stored
from haptic_server.limits import limits_of
from haptic_server.servo.device.simulated import Simulated
from haptic_server.servo.force import guard, latch, rendering, sampled, velocity
from haptic_server.servo.simulation import phantom
from held_arms import KNOWN, Trial, play, scene_of

_JUDGED = (
    arm_witness, bounds, contact_bounds, entry_speed, envelope, guard, held_arms, latch, phantom, rendering, sampled,
    sampled_contact, velocity,
)  # fmt: skip


def known() -> list[dict[str, Any]]:
    """Each of KNOWN: what refuses it, and what the guard alone makes of it."""
    rows: list[dict[str, Any]] = []
    for name, values in KNOWN.items():
        scene = scene_of(**values)
        row: dict[str, Any] = {"case": name, **values}
        try:
            envelope.require(law_of(scene), limits_of(scene, Simulated(scene).info().specification))
            row["refused"] = ""
        except Refusal as refusal:
            row["refused"] = str(refusal)
        verdict = arm_witness.held(live_sets.servo_of(scene), 6.0)
        rows.append(row | {"guard_alone": verdict._asdict()})
    return rows


def search(job: tuple[int, int]) -> dict[str, Any]:
    """So many sets from one seed; what was unsafe, and the worst that was seen."""
    seed, count = job
    rng = np.random.default_rng(seed)
    unsafe: list[dict[str, Any]] = []
    stopped: list[dict[str, Any]] = []  # by the servo's own fault, though it was safe
    worst = {"late_m_per_s": 0.0, "late_entry_m_per_s": 0.0}
    tried, near = 0, 0
    for number in range(count):
        close = number % 2 == 0
        trial = Trial(rng, close)
        tried, near = tried + trial.tried, near + close
        other = Trial(rng, close) if number % 4 == 3 else None
        row = play(trial, other, guarded=number % 8 >= 4)
        if not row["safe"] or row["fault"] != 0:
            (stopped if row["safe"] else unsafe).append(
                {**trial.values, "seed": seed, "number": number, **row}
            )
        for name, value in worst.items():
            worst[name] = max(value, float(row[name]))
    found = {"unsafe": unsafe, "stopped": stopped}
    return {"seed": seed, "sets": count, "tried": tried, "near": near, **found, **worst}


def _fingerprint() -> str:
    """Hash of all that a verdict depends on: with other text the search begins anew."""
    digest = hashlib.sha256()
    for module in _JUDGED:
        digest.update(inspect.getsource(module).encode())
    return digest.hexdigest()[:16]


def _begun(stored: dict[str, Any], seed: int) -> dict[str, Any]:
    """The search so far, if the same was searched; else an empty one from `seed` on."""
    of = _fingerprint()
    if stored.get("search", {}).get("of") == of:
        return {**stored["search"], "guard": guard_version()}
    counts = {"sets": 0, "drawn": 0, "within_2_percent_of_the_boundary": 0}
    worst = {"worst_late_m_per_s": 0.0, "worst_late_entry_m_per_s": 0.0, "wall_s": 0.0}
    return {
        "of": of,
        "guard": guard_version(),
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "seed": seed,
        "next_seed": seed,
        **counts,
        "unsafe": [],
        "stopped": [],
        **worst,
    }


def _add(search: dict[str, Any], part: dict[str, Any]) -> None:
    search["next_seed"] = part["seed"] + 1
    for total, name in (("sets", "sets"), ("drawn", "tried"), ("within_2_percent_of_the_boundary", "near")):
        search[total] += part[name]
    for verdict in ("unsafe", "stopped"):
        search[verdict] += part[verdict]
    for name in ("late_m_per_s", "late_entry_m_per_s"):
        search[f"worst_{name}"] = max(search[f"worst_{name}"], part[name])


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--sets", type=int, default=1_000_000)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    arguments.add_argument("--part", type=int, default=1000, help="sets of one seed")
    arguments.add_argument("--minutes", type=float, default=math.inf, help="stop after so long")
    arguments.add_argument("--known", action="store_true", help="only the sets that once hammered")
    given = arguments.parse_args()
    kept = stored.read("held_arm") if stored.exists("held_arm") else {}
    kept |= {"known": known(), "guard": guard_version()}
    for row in kept["known"]:
        print(row["case"], "|", row["refused"] or "ACCEPTED", "|", row["guard_alone"])
    if not given.known:
        os.nice(10)
        found = _begun(kept, given.seed)
        missing = max(-(-(given.sets - found["sets"]) // given.part), 0)
        jobs = [(found["next_seed"] + at, given.part) for at in range(missing)]
        begun, before_s = time.monotonic(), found["wall_s"]
        with multiprocessing.get_context("spawn").Pool(given.workers) as pool:
            for number, part in enumerate(pool.imap(search, jobs), 1):  # in order: what is stored has no gaps
                _add(found, part)
                gone_s = time.monotonic() - begun
                found["wall_s"] = round(before_s + gone_s, 1)
                for verdict in ("unsafe", "stopped"):
                    for row in part[verdict]:
                        print(verdict.upper(), row, flush=True)
                if number % 10 == 0 or gone_s > 60.0 * given.minutes:
                    kept["search"] = found
                    stored.store("held_arm", kept)
                    print(f"{found['sets']} sets, {gone_s:.0f} s", flush=True)
                if gone_s > 60.0 * given.minutes:
                    pool.terminate()
                    break
        kept["search"] = found
        print(json.dumps({k: v for k, v in found.items() if k not in ("unsafe", "stopped")}), flush=True)
        print(f"{len(found['unsafe'])} unsafe, {len(found['stopped'])} safe ones stopped by a fault")
    stored.store("held_arm", kept)


if __name__ == "__main__":
    main()
