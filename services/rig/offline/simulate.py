"""`drumstick simulate`: the contacts of a scene's stick, by `exact` or by a stepper."""

import json
from typing import Any

from rig import scene_file
from rig.exit_status import usage_error

DEFAULT_DT_S = 1e-5
_MAX_CONTACTS = 1_000_000  # half a day of a roll, and half a gigabyte until they are written
_MAX_STEPS = 1e10  # some ten minutes


def simulate(
    scene: str,
    duration_s: float,
    v0_m_per_s: float,
    method: str,
    dt_s: float | None,
    locates: bool,
    as_json: bool,
) -> None:
    """Print the contacts as a table or as one JSON object. Raises CommandError."""
    loaded = scene_file.load(scene)
    from drumstick.public.run import simulate as run_of
    from drumstick.stick import simulate as exact_run

    if method not in exact_run.METHODS:
        usage_error(f"--method {method}: there is {', '.join(exact_run.METHODS)}")
    stepper = None
    if loaded.hand.hands != 1 and method != exact_run.EXACT:
        usage_error(
            f"--method {method}: {loaded.name} has two sticks in hands that move: only exact plays them"
        )
    if method != exact_run.EXACT and (loaded.hand_moves_stick or loaded.hand.human is not None):
        usage_error(f"--method {method}: {loaded.name} has a hand that moves: only exact plays it")
    if method != exact_run.EXACT:
        try:
            stepper = exact_run.Stepper(method, DEFAULT_DT_S if dt_s is None else dt_s, locates)
        except ValueError as error:
            usage_error(f"--dt: {error}")
        if duration_s / stepper.dt_s > _MAX_STEPS:
            usage_error(
                f"--duration {duration_s:g} s are {duration_s / stepper.dt_s:.3g} steps of {stepper.dt_s:g} s,"
                f" more than {_MAX_STEPS:g}: give a shorter --duration or a longer --dt"
            )
    elif dt_s is not None or not locates:
        steppers = ", ".join(exact_run.METHODS[1:])
        usage_error(
            f"--method exact has no time step and finds every event: --dt and --no-events go with {steppers}"
        )
    gesture = scene_file.gesture(scene, loaded)
    try:
        run = run_of(loaded, duration_s, v0_m_per_s, stepper, _MAX_CONTACTS, gesture)
    except exact_run.TooLong as error:
        usage_error(f"--duration {duration_s:g} s: {error}: give a shorter one")
    names = run.contacts.dtype.names or ()
    contacts: list[dict[str, Any]] = [dict(zip(names, row, strict=True)) for row in run.contacts.tolist()]
    if as_json:
        print(json.dumps({"scene": loaded.name, "method": method, "contacts": contacts, "end": run.end}))
        return
    print(
        "      t_in s   v_in m/s     t_out s  v_out m/s    v_E m/s     peak N  impulse Ns   z_min mm  level"
    )
    for c in contacts:
        print(
            f"{c['t_in_s']:12.6f} {c['v_in_m_per_s']:10.5f} {c['t_out_s']:11.6f} {c['v_out_m_per_s']:10.5f}"
            f" {c['v_e_m_per_s']:10.5f} {c['peak_force_N']:10.4f} {c['impulse_N_s']:11.6f} {c['z_min_m'] * 1e3:10.5f}"
            f" {c['level']:6.3f}"
        )
    words = {
        "time": f"after {duration_s:g} s",
        "captured": "captured: the stick rests in the head",
        "left": "left",
    }
    rate = f", roll {run.rate_Hz:.4f} Hz" if len(contacts) > 1 else ""
    print(f"{len(contacts)} contacts, {words[run.end]}{rate}")
