"""`drumstick scene cost`: what each effect and the mesh of a scene cost on this machine, and what that buys."""

import dataclasses
import json
import math
import statistics
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from typing import Any

from drumstick.drum.effects.registry import NEEDS
from drumstick.parameters.scene import Scene
from rig import scene_file
from rig.supervision.preflight import playable
from sound_server.ranges import DEFAULT_RATE_HZ

_TICKS = 20_000
_REPEATS = 5
_STEPS_S = (1e-3, 1e-4, 1e-5)
_STEPPER = "rk4"
_FRAMES = 12_000
_LONG_T60_S = 20.0  # so that there is something left to measure the pitch of
# Somebody waits for the answer: a large head is measured fewer times, and its pitch not at all where that takes long.
_RUNS_S = 1.0
_PITCH_S = 2.0
_SEMITONE = 2.0 ** (1.0 / 12.0)
_now = time.monotonic
ACCURACIES = ("draft", "standard", "fine")

Step = Callable[[str], None]


@contextmanager
def _progress(steps: int) -> Generator[Step]:
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=steps)

        def step(what: str) -> None:
            bar.update(task, advance=1, description=what)

        yield step


def _stick(scene: Scene, step: Step) -> dict[str, Any]:
    # Interleaved, so that a busy moment of the machine hits all alike.
    from drumstick.stick import cost

    variants = {"all": scene} | {name: cost.without(scene, name) for name in scene.effects}
    variants["none"] = dataclasses.replace(scene, effects={})
    runs: dict[str, list[float]] = {name: [] for name in variants}
    rates: dict[str, float] = {}
    for _ in range(_REPEATS):
        for name, variant in variants.items():
            step(f"stick: {'all effects' if name == 'all' else 'without ' + name}")
            found = cost.tick_cost(variant, _TICKS)
            runs[name].append(found.ns)
            rates[name] = found.contacts_per_s
    ns = {name: statistics.median(found) for name, found in runs.items()}
    period_ns = 1e9 / scene.servo.rate_Hz
    return {
        "rate_Hz": scene.servo.rate_Hz,
        "tick_ns": ns["all"],
        "share_of_core": ns["all"] / period_ns,
        "tick_ns_without_effects": ns["none"],
        "contacts_per_s": rates["all"],
        "effects": {
            name: {"ns_per_tick": ns["all"] - ns[name], "contacts_per_s_without": rates[name]}
            for name in scene.effects
        },
    }


def _methods(scene: Scene, step: Step) -> list[dict[str, Any]]:
    from drumstick.stick import cost
    from drumstick.stick.simulate import EXACT, Stepper

    rows: list[dict[str, Any]] = []
    steppers = [None, *(Stepper(_STEPPER, dt, locates) for dt in _STEPS_S for locates in (True, False))]
    for stepper in steppers:
        step(f"stick: {stepper.name if stepper else EXACT}")
        found = cost.stepper_cost(scene, stepper, 1.0)
        rows.append(
            {
                "method": stepper.name if stepper else EXACT,
                "dt_s": stepper.dt_s if stepper else None,
                "finds_events": stepper.locates if stepper else True,
                "ns_per_tick": found.ns_per_s / scene.servo.rate_Hz,
                "error_s": found.error_s if found.error_s < float("inf") else None,
            }
        )
    return rows


def _pinned(scene: Scene) -> Scene:
    # The scene's mesh by its order and rate: what is left out of the drum may not bring another scheme.
    from drumstick.drum import tiers

    divisor = tiers.divisor_for(scene, DEFAULT_RATE_HZ)
    order = tiers.order_of(scene, DEFAULT_RATE_HZ / divisor)
    mesh = dataclasses.replace(
        scene.mesh,
        accuracy="fine" if order == 4 else "standard",
        rate_Hz=DEFAULT_RATE_HZ / divisor,
        junctions_across=0.0,
        cpu_budget=math.inf,
    )
    return dataclasses.replace(scene, mesh=mesh)


def _without(scene: Scene, effect: str) -> Scene:
    # And without what needs it.
    needing = {name for name, (needed, _) in NEEDS.items() if needed == effect}
    effects = {name: table for name, table in scene.drum.effects.items() if name not in {effect, *needing}}
    return dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, effects=effects))


def _while_time(seconds: float) -> Iterator[int]:
    # The repeats of a measurement: one at least, and no new one once so much time has gone by.
    begun = _now()
    for run in range(_REPEATS):
        if run and _now() - begun >= seconds:
            return
        yield run


def _drum_effects(scene: Scene, step: Step) -> dict[str, float]:
    # ns a sample that each effect of the drum adds to all the others; in turn, as the stick's.
    from drumstick.drum.measurement import cost

    whole = scene if scene.modal is not None else _pinned(scene)
    tried = {"": whole} | {name: _without(whole, name) for name in scene.drum.effects}
    runs: dict[str, list[float]] = {name: [] for name in tried}
    for _ in _while_time(len(tried) * _RUNS_S) if scene.drum.effects else ():
        for name, drum in tried.items():
            step(f"drum without {name}" if name else "drum")
            runs[name].append(cost.ringing(drum, DEFAULT_RATE_HZ, _FRAMES).cpu_s / _FRAMES * 1e9)
    # The median of the rounds' own differences.
    return {
        name: statistics.median(a - b for a, b in zip(runs[""], runs[name], strict=True))
        for name in scene.drum.effects
    }


def _tiers(scene: Scene) -> dict[str, Scene]:
    # The scene at each accuracy of the mesh, and with its bank of modes if it has one.
    def meshed(accuracy: str) -> Scene:
        return dataclasses.replace(scene, modal=None, mesh=dataclasses.replace(scene.mesh, accuracy=accuracy))

    from drumstick.drum.fitting import fitted

    own = {} if scene.modal is None else {"modal": scene}
    if scene.mesh.accuracy == "auto":
        own["auto"] = fitted(scene, DEFAULT_RATE_HZ).scene  # of which the pitch is measured too
    return {accuracy: meshed(accuracy) for accuracy in ACCURACIES} | own


def _tier(tried: Scene) -> dict[str, Any]:
    from drumstick.drum.measurement import cost

    runs = [cost.ringing(tried, DEFAULT_RATE_HZ, _FRAMES) for _ in _while_time(_RUNS_S)]
    cpu_s = statistics.median(run.cpu_s for run in runs)
    pitch_takes_s = cpu_s / _FRAMES * DEFAULT_RATE_HZ * cost.PITCH_HEARD_S
    measured = pitch_takes_s <= _PITCH_S
    # The head's own pitch: alone, and for long enough to be measured.
    alone = dataclasses.replace(tried, drum=dataclasses.replace(tried.drum, t60_s=_LONG_T60_S, effects={}))
    return {
        "ns_per_sample": cpu_s / _FRAMES * 1e9,
        "share_of_core": cpu_s * DEFAULT_RATE_HZ / _FRAMES,
        "junctions": runs[0].junctions,
        "mesh_rate_Hz": round(runs[0].steps * DEFAULT_RATE_HZ / _FRAMES),
        "f01_error_cents": cost.f01_error_cents(alone, DEFAULT_RATE_HZ) if measured else None,
        "pitch_would_take_s": None if measured else pitch_takes_s,
    }


def _replacement_s(scene: Scene) -> dict[str, float]:
    # Until another drum is built, for each value that needs one: a semitone higher, or as much longer.
    from drumstick.drum.calibrate import build
    from drumstick.drum.memory.strikes import StrikeRing
    from drumstick.drum.rebuilt import rebuilt_values, scene_rebuilt
    from drumstick.scenes.table import table_of

    rows, found = table_of(scene), dict[str, float]()
    for name, value in rebuilt_values(scene).items():
        if not name.startswith("drum."):  # another mallet, glide or second head takes as long
            continue
        other = scene_rebuilt(scene, {name: min(value * _SEMITONE, rows[name].quantity.high)})
        begun = _now()
        build(other, DEFAULT_RATE_HZ, StrikeRing())
        found[name] = _now() - begun
    return found


def _sound(scene: Scene, step: Step) -> dict[str, Any]:
    from drumstick.drum.build import Unplayable
    from drumstick.drum.fitting import fitted

    fit = fitted(scene, DEFAULT_RATE_HZ, again=True)
    rows: dict[str, Any] = {}
    for accuracy, tried in _tiers(scene).items():
        step(f"drum: {accuracy}")
        try:
            rows[accuracy] = _tier(tried)
        except Unplayable as error:
            if accuracy == scene.mesh.accuracy:
                raise
            rows[accuracy] = {
                "unplayable": str(error)
            }  # the scene plays; what else it could have had does not
    effects = {name: {"ns_per_sample": ns} for name, ns in _drum_effects(fit.scene, step).items()}
    return {
        "device_rate_Hz": DEFAULT_RATE_HZ,
        "accuracy": scene.mesh.accuracy if scene.modal is None else "modal",
        "tiers": rows,
        "chosen": fit.note,
        "effects": effects,
        "replacement_s": _replacement_s(fit.scene),
    }


def measure(scene: Scene) -> dict[str, Any]:
    """Everything `scene cost` tells, as one JSON object."""
    steps = (
        _REPEATS * (len(scene.effects) + 2)
        + 1
        + 2 * len(_STEPS_S)
        + len(_tiers(scene))
        + (_REPEATS * (1 + len(scene.drum.effects)) if scene.drum.effects else 0)
    )
    with _progress(steps) as step:
        return {
            "scene": scene.name,
            "stick": _stick(scene, step),
            "methods": _methods(scene, step),
            "sound": _sound(scene, step),
        }


def _pitch(row: dict[str, Any]) -> str:
    if row["f01_error_cents"] is None:
        return f"not measured: {row['pitch_would_take_s']:.0f} s of computing"
    return f"{row['f01_error_cents']:+12.3f} cents"


def _shown(found: dict[str, Any]) -> Iterator[str]:
    stick, sound = found["stick"], found["sound"]
    yield f"{found['scene']} on this machine"
    yield ""
    yield (
        f"stick, exact: {stick['tick_ns']:.0f} ns a tick at {stick['rate_Hz']} Hz, "
        f"{100.0 * stick['share_of_core']:.2f} % of a core, {stick['contacts_per_s']:.1f} contacts a second"
    )
    for name, row in stick["effects"].items():
        yield (
            f"  {name:18s} {row['ns_per_tick']:+7.0f} ns a tick; "
            f"without it {row['contacts_per_s_without']:.1f} contacts a second"
        )
    yield f"  {'no effect at all':18s} {stick['tick_ns_without_effects']:7.0f} ns a tick"
    yield ""
    yield "what a time step would cost instead          ns a tick   error of the first ten contacts"
    for row in found["methods"]:
        dt = "" if row["dt_s"] is None else f"{row['dt_s']:g} s"
        events = "" if row["finds_events"] else ", events unseen"
        error = "misses contacts" if row["error_s"] is None else f"{row['error_s']:.1e} s"
        if row["dt_s"] is None:
            error = "none but rounding, about 1e-15 of the time"
        yield f"  {row['method'] + ' ' + dt + events:40s} {row['ns_per_tick']:12.0f}   {error}"
    yield ""
    yield f"drum at {sound['device_rate_Hz']} Hz       ns per sample   of a core   junctions   error of the pitch"
    for accuracy, row in sound["tiers"].items():
        mark = "*" if accuracy == sound["accuracy"] else " "
        if "unplayable" in row:
            yield f"{mark} {accuracy:20s} cannot be: {row['unplayable']}"
            continue
        yield (
            f"{mark} {accuracy:20s} {row['ns_per_sample']:12.0f} {100.0 * row['share_of_core']:9.2f} %"
            f" {row['junctions']:11d} {_pitch(row)}"
        )
    yield "* what this scene asks for"
    if sound["chosen"]:
        yield f"  {sound['chosen']}"
    for name, row in sound["effects"].items():
        yield f"  {name:20s} {row['ns_per_sample']:+12.0f} ns per sample"
    for name, seconds in sound["replacement_s"].items():
        yield f"  another {name:12s} {1e3 * seconds:12.0f} ms, built beside the drum that plays"


def cost(scene: str, as_json: bool) -> None:
    """Measure and print. Raises CommandError."""
    loaded = scene_file.load(scene)
    with playable():
        found = measure(loaded)
    print(json.dumps(found) if as_json else "\n".join(_shown(found)))
