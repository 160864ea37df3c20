"""The error of the whole way: stick, servo, message, mesh, effects and output, each in its unit and in JND, over its cost.

Each choice is compared with the truest one that is known of its stage, all else alike: exact contacts; the closed-form
rebound; the exact contact's force; a fourth-order mesh at REFERENCE_Hz or a bank of modes up to REFERENCE_TOP_Hz. How
far that reference itself still moves stands in the rows of stage `reference`. Sounds are told apart by ERB bands
(drumstick.perception.erb), JNDs are those of drumstick.perception.jnd. Any thread; blocks while it computes.

Left out: the sink and the air (buffers of a sound card are the machine's own), a press as the hand plays it (a message
cannot tell it), and what the effects of the stick do to the hand.
"""

import dataclasses
import math
import os
import time
from collections.abc import Callable, Iterator
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np

import drumstick as ds
from drumstick.drum import estimate
from drumstick.drum.effects.registry import MESH_EFFECTS
from drumstick.drum.measurement import cost
from drumstick.drum.memory.strikes import OfflineStrike
from drumstick.drum.render import render
from drumstick.parameters.drum import Mesh
from drumstick.parameters.scene import Scene
from drumstick.perception import jnd
from drumstick.perception.erb import spectral_distance
from drumstick.stick.simulate import Stepper
from drumstick_lab.accuracy import servo
from drumstick_lab.accuracy.choices import pitch_jnd
from drumstick_lab.accuracy.drums import blows, drum_effects, wire_cost
from drumstick_lab.accuracy.excitation import blow_sound
from drumstick_lab.accuracy.job import Job
from drumstick_lab.accuracy.sticks import falling
from drumstick_lab.accuracy.sticks.falling import Sampled
from drumstick_lab.accuracy.sticks.filters import ADAPTIVE
from drumstick_lab.accuracy.timing import CHAIN, chain, in_turn

Row = dict[str, Any]
PLAYINGS, QUICK_PLAYINGS = ("roll", "grip", "accents", "snare", "timpani"), ("roll",)
REFERENCE_Hz, NEXT_Hz = 48_000.0, 24_000.0
REFERENCE_TOP_Hz, NEXT_TOP_Hz = 10_000.0, 7_000.0
MIDDLE_Hz = 4_000.0  # most of a drum's sound lies below
TIERS = ("draft", "standard", "fine")
_RATE_Hz = 48_000
_LASTS_S = 1.5
_STEPPERS = (
    Stepper("rk4", 1e-4, True),
    Stepper("rk4", 1e-3, True),
    Stepper("semi_implicit_euler", 1e-4, False),
)
_COMPARED = 10  # contacts
_SERVOS = tuple(
    Sampled(1000.0, rate_Hz, delay, predictor)
    for rate_Hz, delay in ((500, 0), (1000, 0), (1000, 1), (4000, 0))
    for predictor in falling.PREDICTORS
)
_STREAMS_Hz = (1000.0, 4000.0)
_FRAMES, _RUNS = 12_000, 2
_BYTES_PER_JUNCTION = 12  # two levels in time and a weight, float32


class Measure(NamedTuple):
    """One error: what is off, by how much, in which unit, and in just noticeable differences."""

    what: str
    value: float
    unit: str
    jnds: float


def _row(stage: str, playing: str, choice: str, measures: list[Measure], **costs: float | None) -> Row:
    worst = max(measures, key=lambda measure: measure.jnds)
    # No ratio to a yardstick: each cost is of one or two runs.
    found = {"share_of_core": None, "memory_bytes": None, "latency_ms": None, "ratio": None} | costs
    return {
        "stage": stage,
        "playing": playing,
        "choice": choice,
        "measures": [measure._asdict() for measure in measures],
        "jnds": worst.jnds,
        "binds": worst.what,
        **found,
    }


def _spectra(sound: Any, wanted: Any) -> list[Measure]:
    found: list[Measure] = []
    for what, below_Hz in (("spectrum", math.inf), (f"spectrum below {MIDDLE_Hz / 1e3:g} kHz", MIDDLE_Hz)):
        off_dB = spectral_distance(sound[:, 0], wanted[:, 0], _RATE_Hz, below_Hz)
        found.append(Measure(what, off_dB, "dB", off_dB / jnd.LEVEL_dB))
    return found


@cache
def _played(playing: str) -> tuple[Scene, list[OfflineStrike]]:
    scene = ds.scene(playing)
    return scene, ds.simulate(scene, _LASTS_S).drum_strikes()


def _sound(scene: Scene, strikes: list[OfflineStrike]) -> Any:
    return render(scene, strikes, _LASTS_S, _RATE_Hz)


def _meshed(scene: Scene, accuracy: str, rate_Hz: float = 0.0) -> Scene:
    mesh = Mesh(accuracy=accuracy, rate_Hz=rate_Hz, cpu_budget=math.inf)  # pyright: ignore[reportArgumentType]
    return dataclasses.replace(scene, mesh=mesh)


def _topped(scene: Scene, top_Hz: float) -> Scene:
    assert scene.modal is not None
    return dataclasses.replace(scene, modal=dataclasses.replace(scene.modal, top_Hz=top_Hz))


@cache
def _reference(playing: str) -> Any:
    scene, strikes = _played(playing)
    true = _meshed(scene, "fine", REFERENCE_Hz) if scene.modal is None else _topped(scene, REFERENCE_TOP_Hz)
    return _sound(true, strikes)


def _of_drum(stage: str, playing: str, choice: str, scene: Scene) -> Row:
    strikes = _played(playing)[1]
    measures = _spectra(_sound(scene, strikes), _reference(playing))
    if scene.modal is None:
        cents = estimate.of("", scene, _RATE_Hz).cents
        measures.append(Measure("pitch", cents, "cents", cents / pitch_jnd({"f01_Hz": scene.drum.f01_Hz})))
    runs = [cost.ringing(scene, _RATE_Hz, _FRAMES) for _ in range(_RUNS)]
    share = min(run.cpu_s for run in runs) * _RATE_Hz / _FRAMES
    memory = _BYTES_PER_JUNCTION * runs[0].junctions
    return _row(stage, playing, choice, measures, share_of_core=share, memory_bytes=memory)


def drums(playing: str) -> Iterator[Row]:
    """Rows of the drum of a shipped scene at each tier, or of its bank of modes at two tops."""
    scene, _ = _played(playing)
    if scene.modal is not None:
        two = f"bank to {NEXT_TOP_Hz:g} Hz beside {REFERENCE_TOP_Hz:g} Hz"
        yield _of_drum("reference", playing, two, _topped(scene, NEXT_TOP_Hz))
        for top_Hz in (2000.0, scene.modal.top_Hz):
            yield _of_drum("drum", playing, f"bank to {top_Hz:g} Hz", _topped(scene, top_Hz))
        return
    two = f"fine, {NEXT_Hz:g} Hz beside {REFERENCE_Hz:g} Hz"
    yield _of_drum("reference", playing, two, _meshed(scene, "fine", NEXT_Hz))
    for accuracy in TIERS:
        meshed = _meshed(scene, accuracy)
        rate_Hz = estimate.of(accuracy, meshed, _RATE_Hz).mesh_rate_Hz
        yield _of_drum("drum", playing, f"{accuracy}, {rate_Hz:g} Hz", meshed)


def _effects(names: tuple[str, ...]) -> Iterator[Row]:
    # What goes when one is left out.
    for name in names:
        less = drum_effects.heard(drum_effects.without(name))
        measures = _spectra(less, drum_effects.heard(name))
        yield _row("effects", "two blows on the default drum", f"without {name}", measures)


def _sticks(playing: str) -> Iterator[Row]:
    scene, _ = _played(playing)
    true = ds.simulate(scene, _LASTS_S)
    for stepper in (None, *_STEPPERS):
        ds.simulate(scene, 0.1, stepper=stepper)  # compiles
        begun = time.thread_time()
        run = ds.simulate(scene, _LASTS_S, stepper=stepper)
        share = (time.thread_time() - begun) / _LASTS_S
        count = min(_COMPARED, len(run.contacts))
        off_s = run.contacts["t_in_s"][:count] - true.contacts["t_in_s"][:count]
        speeds = run.contacts["v_out_m_per_s"][:count] / true.contacts["v_out_m_per_s"][:count] - 1.0
        onset_s, speed = float(np.max(np.abs(off_s))), float(np.max(np.abs(speeds)))
        measures = [
            Measure("onset", 1e3 * onset_s, "ms", onset_s / jnd.LATENCY_SPREAD_s),
            Measure("speed given back", 100.0 * speed, "%", speed / jnd.STIFFNESS),
        ]
        yield _row(
            "stick",
            playing,
            "exact" if stepper is None else f"{stepper.name}, dt {stepper.dt_s:g} s",
            measures,
            share_of_core=share,
        )


def _servos() -> Iterator[Row]:
    cases = [servo.Case(each.rate_Hz, each.delay_ticks, each.k_coll) for each in _SERVOS]
    costs = servo.tick_costs(list(dict.fromkeys(cases)), (ADAPTIVE,), rounds=6)
    for device in _SERVOS:
        softest = device._replace(k_coll=servo.STIFFNESSES[0])
        scene = device.scene()
        given, due = falling.rebounds(scene, False), falling.design(device.k_coll)
        # Of the impulse that the hand feels, which is m v (1 + restitution).
        felt = max(abs(each - due) for each in given) / (1.0 + due)
        tick_s = 1.0 / device.rate_Hz
        spread_s = tick_s / math.sqrt(12.0)
        late_s = (0.5 + device.delay_ticks) * tick_s
        measures = [
            Measure("impulse felt", 100.0 * felt, "%", felt / jnd.STIFFNESS),
            Measure("spread of the onset", 1e3 * spread_s, "ms", spread_s / jnd.LATENCY_SPREAD_s),
            Measure("latency", 1e3 * late_s, "ms", late_s / jnd.LATENCY_s),
        ]
        # Whether an arm is late is nobody's choice.
        playing = "a fall, the arm a tick late" if device.delay_ticks else "a fall, the arm in time"
        choice = f"{device.rate_Hz} Hz, predictor {device.predictor}"
        share = 1e-9 * costs.tick_ns[softest, ADAPTIVE] * device.rate_Hz
        row = _row("servo", playing, choice, measures, share_of_core=share, latency_ms=1e3 * late_s)
        yield row | {"refused": not falling.passes(scene)}


def _messages() -> Iterator[Row]:
    servo_Hz = float(blows.scene(False).servo.rate_Hz)
    at_s = (math.floor(0.05 * servo_Hz) + 0.5) / servo_Hz
    wanted = blow_sound(None, at_s, False)
    for rate_Hz in (None, *_STREAMS_Hz):
        sound = blow_sound(rate_Hz, at_s, rate_Hz is None)
        late_s = (
            0.5 / servo_Hz + 0.5 * wire_cost.BLOCK_S if rate_Hz is None else wire_cost.streaming_delay_s()
        )
        spent_ns = in_turn({"": wire_cost.analytic() if rate_Hz is None else wire_cost.streamed(rate_Hz)}, 4)[
            ""
        ]
        measures = [*_spectra(sound, wanted), Measure("latency", 1e3 * late_s, "ms", late_s / jnd.LATENCY_s)]
        choice = "analytic" if rate_Hz is None else f"streamed, {rate_Hz:g} Hz"
        yield _row(
            "message", "a blow of the roll", choice, measures,
            share_of_core=1e-9 * spent_ns * 23.0, memory_bytes=wire_cost.bytes_of(rate_Hz), latency_ms=1e3 * late_s,
        )  # fmt: skip


def _output(playing: str) -> Iterator[Row]:
    scene, strikes = _played(playing)
    sound = _sound(scene, strikes)
    rounded = np.rint(32767.0 * sound) / 32767.0
    yield _row("output", playing, "16 bits", _spectra(rounded, sound))


def jobs(quick: bool, found: Row) -> Iterator[Job]:
    """Notes date, load, playings, rows and yardstick_ns. Quick: the roll alone, and four effects."""
    rows: list[Row] = []
    playings = QUICK_PLAYINGS if quick else PLAYINGS
    today, load = time.strftime("%Y-%m-%d"), round(os.getloadavg()[0], 1)
    found |= {"date": today, "load": load, "playings": list(playings), "rows": rows}

    def add(more: Callable[[], Iterator[Row]]) -> None:
        rows.extend(more())

    def yardstick() -> None:
        found["yardstick_ns"] = {CHAIN: in_turn({CHAIN: chain()}, 10)[CHAIN]}

    yield Job("whole: stick", partial(add, partial(_sticks, "roll")))
    yield Job("whole: servo", partial(add, _servos))
    yield Job("whole: message", partial(add, _messages))
    for playing in playings:
        yield Job(f"whole: drum of {playing}", partial(add, partial(drums, playing)))
    # Without neighbours nothing is to be heard of `sympathy`.
    names = drum_effects.QUICK if quick else tuple(name for name in MESH_EFFECTS if name != "sympathy")
    yield Job("whole: effects", partial(add, partial(_effects, names)))
    yield Job("whole: output", partial(add, partial(_output, "roll")))
    yield Job("whole: yardstick", yardstick)
