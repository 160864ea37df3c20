"""Cost of accuracy in time, stick only: drumstick lab stick-methods [--rounds 12].

`exact` against scipy's solve_ivp (DOP853, terminal events, rtol 1e-10) on the same bounces; every stepper with and
without event location over its step; scipy over its tolerance; and what bounds `exact`. Errors are the largest relative
error of any instant or speed of the first contacts against a solution to 40 digits (tests/mp_stick.py). CPU time of the
thread, windows of the methods in turn, the best of each.
"""

import argparse
from typing import Any

import bounces
from drumstick.stick.methods.carry import ORDERS, STEPPERS
from drumstick.stick.simulate import Stepper
from drumstick_lab.accuracy.stick import ATOL_PER_RTOL, STEPS_S, TOLERANCES
from drumstick_lab.accuracy.sticks import solve_ivp_stick
from drumstick_lab.accuracy.sticks.contacts import finite, largest_error
from drumstick_lab.benchmarks.stick.closed_form import point_ns
from drumstick_lab.measuring import stored

SWEPT = ("roll", "unilateral")
TICKS_Hz = (1000.0, 10_000.0)
LENGTHS = (1, 8, 25, 100)  # contacts


def against_scipy(rounds: int) -> dict[str, Any]:
    rows: dict[str, Any] = {}
    for name, case in bounces.CASES.items():
        window, ours, theirs = bounces.Window(name), [], []
        for _ in range(rounds):
            theirs.append(bounces.scipy_window(name))
            ours += [window(), window(), window()]
        true = bounces.reference(name)
        rows[name] = {
            "words": case.words,
            "bounces": case.bounces,
            "events_per_bounce": window.events_per_bounce,
            "exact_us": min(ours) * 1e6,
            "solve_ivp_us": min(theirs) * 1e6,
            "ratio": min(theirs) / min(ours),
            "exact_error": largest_error(bounces.contacts(name), true),
            "solve_ivp_error": largest_error(bounces.played_by_scipy(name).contacts, true),
        }
        print(name, rows[name])
    return rows


def steppers(name: str, rounds: int) -> dict[str, Any]:
    """CPU time a simulated second, and error, of every stepper at every step; `exact` beside it."""
    true, bounces_per_s = (
        bounces.reference(name),
        bounces.CASES[name].bounces / bounces.reference(name)[-1, 2],
    )
    exact = bounces.Window(name)
    rows: list[dict[str, Any]] = []
    for method in STEPPERS:
        for locates in (True, False):
            for dt_s in STEPS_S:
                stepper = Stepper(method, dt_s, locates)
                window = bounces.Window(name, stepper, copies=max(1, int(dt_s * 2e5)))
                spent = min(window() for _ in range(rounds))
                wrong = finite(largest_error(bounces.contacts(name, stepper), true))
                row = {"method": method, "locates": locates, "dt_s": dt_s, "error": wrong}
                rows.append(row | {"us_per_s": spent * bounces_per_s * 1e6})
    best = min(exact() for _ in range(rounds))
    return {
        "orders": ORDERS,
        "bounces_per_s": bounces_per_s,
        "exact": {
            "us_per_s": best * bounces_per_s * 1e6,
            "error": largest_error(bounces.contacts(name), true),
        },
        "steppers": rows,
    }


def scipy_tolerances(name: str, rounds: int) -> list[dict[str, Any]]:
    window, true = bounces.Window(name), bounces.reference(name)
    rows: list[dict[str, Any]] = []
    for rtol in TOLERANCES:
        atol = rtol * ATOL_PER_RTOL
        ours, theirs = [], []
        for _ in range(rounds):
            theirs.append(bounces.scipy_window(name, rtol, atol))
            ours.append(window())
        case = bounces.CASES[name]
        found = solve_ivp_stick.play(case.scene, case.bounces, bounces.THROW_M_PER_S, rtol, atol).contacts
        rows.append(
            {
                "rtol": rtol,
                "us": min(theirs) * 1e6,
                "ratio": min(theirs) / min(ours),
                "error": largest_error(found, true),
            }
        )
    return rows


def limits(name: str, rounds: int) -> dict[str, Any]:
    """Limits of `exact`: the closed form's own cost, ticks that cut bounces, and rounding over many contacts."""
    free = bounces.Window(name)
    best = min(free() for _ in range(rounds))
    ticked: dict[str, float] = {}
    for rate_Hz in TICKS_Hz:
        window = bounces.Window(name, tick_s=1.0 / rate_Hz)
        ticked[f"{rate_Hz:g}"] = min(window() for _ in range(rounds)) * 1e6
    drift = {str(length): bounces.error_after(name, length) for length in LENGTHS}
    return {"exact_us": best * 1e6, "point_ns": point_ns(name), "ticked_us": ticked, "error_after": drift}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=12)
    rounds = parser.parse_args().rounds
    result = {
        "rounds": rounds,
        "throw_m_per_s": bounces.THROW_M_PER_S,
        "solve_ivp": {key: getattr(solve_ivp_stick, key) for key in ("METHOD", "RTOL", "ATOL")},
        "against_scipy": against_scipy(rounds),
        "over_step": {name: steppers(name, max(3, rounds // 3)) for name in SWEPT},
        "over_tolerance": {name: scipy_tolerances(name, rounds) for name in SWEPT},
        "limits": {name: limits(name, rounds) for name in SWEPT},
    }
    stored.store("stick_methods", result)


if __name__ == "__main__":
    main()
