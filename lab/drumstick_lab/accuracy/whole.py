"""The error of the whole way: stick, servo, message, mesh, effects and output, each in its unit and in JND, over its cost.

Each choice is compared with the truest one that is known of its stage, all else alike: exact contacts; the closed-form
rebound; the exact contact's force; a fourth-order mesh at REFERENCE_Hz or a bank of modes up to REFERENCE_TOP_Hz. How
far that reference itself is off stands in the rows of stage `reference`: of a plain head beside its modes in closed form,
which share no code with it (drumstick_lab.accuracy.exact); of others, how far it still moves. Sounds are told apart by ERB bands
(drumstick.perception.erb), JNDs are those of drumstick.perception.jnd. Any thread; blocks while it computes.

What the wire does to an onset is measured by `drumstick lab strike-latency` on a rig that plays, and read from there
(drumstick_lab.accuracy.wire). Left out: the sound card and the air, and what the effects of the stick do to the hand.
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
from drumstick.drum.effects.registry import DRUM_TABLES, MESH_EFFECTS
from drumstick.drum.excitation.offline import StreamedContact
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
from drumstick_lab.accuracy.drums import (
    blows,
    drum_effects,
    footprint,
    mallet_blow,
    press,
    stream_onset,
    wire_cost,
)
from drumstick_lab.accuracy.drums.heads import decay_off
from drumstick_lab.accuracy.exact import scene as beside
from drumstick_lab.accuracy.exact.differences import brighter_dB, levelled, louder_dB
from drumstick_lab.accuracy.excitation import blow_sound
from drumstick_lab.accuracy.job import Job
from drumstick_lab.accuracy.sticks import falling
from drumstick_lab.accuracy.sticks.falling import Sampled
from drumstick_lab.accuracy.sticks.filters import ADAPTIVE
from drumstick_lab.accuracy.timing import CHAIN, chain, in_turn

Row = dict[str, Any]
PLAYINGS, QUICK_PLAYINGS = ("roll", "press", "accents", "snare", "timpani"), ("roll",)
PLAIN = ("roll", "accents")  # strikes on a head without effects: solved exactly
LOSSY = "a blow, with internal_loss"  # so is this one
REFERENCE_Hz, NEXT_Hz = 48_000.0, 24_000.0
REFERENCE_TOP_Hz, NEXT_TOP_Hz = 10_000.0, 7_000.0
MIDDLE_Hz = 4_000.0  # most of a drum's sound lies below
LOW_Hz = 1_000.0  # what a servo of 4 kHz still knows well
TIERS = ("draft", "standard", "fine")
_RATE_Hz = 48_000
_LASTS_S = 1.5
_STEPPERS = (
    Stepper("rk4", 1e-4, True),
    Stepper("rk4", 1e-3, True),
    Stepper("semi_implicit_euler", 1e-4, False),
)
_COMPARED = 10  # contacts
FALL_K_COLL = 1000.0  # N/m: the head of the servo's rows
_SERVOS = tuple(
    Sampled(FALL_K_COLL, rate_Hz, delay, predictor)
    for rate_Hz, delay in ((500, 0), (1000, 0), (1000, 1), (4000, 0))
    for predictor in falling.PREDICTORS
)
_STREAMS_Hz = (1000.0, 4000.0)
_FRAMES, _RUNS = 12_000, 2
_PLAYED_TIMES = 5  # a stick's run is some hundred microseconds
_STROKES_Hz, _TIMPANI_STROKES_Hz = 23.0, 13.0
_BLOCK = 64  # of the rig whose delays are measured: lab/results/strike_latency.json


class Measure(NamedTuple):
    """One error: its kind, how large, in which unit, and in just noticeable differences."""

    what: str
    value: float
    unit: str
    jnds: float


def row_of(stage: str, playing: str, choice: str, measures: list[Measure], **costs: float | None) -> Row:
    """A row: its measures, the one that is worst in JND, and costs, None where there are none."""
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


def _spectra(sound: Any, wanted: Any, *bands_Hz: float) -> list[Measure]:
    found: list[Measure] = []
    for below_Hz in (math.inf, MIDDLE_Hz, *bands_Hz):
        what = "spectrum" if below_Hz == math.inf else f"spectrum below {below_Hz / 1e3:g} kHz"
        off_dB = spectral_distance(sound[:, 0], wanted[:, 0], _RATE_Hz, below_Hz)
        found.append(Measure(what, off_dB, "dB", off_dB / jnd.LEVEL_dB))
    return found


class _Played(NamedTuple):
    scene: Scene
    strikes: list[OfflineStrike]
    contacts: list[StreamedContact]


@cache
def _played(playing: str) -> _Played:
    if playing == "press":  # by its force, since a message guesses at the hand
        return _Played(press.scene("streamed"), [], press.contacts(_RATE_Hz))
    if playing == LOSSY:
        scene = beside.with_loss(ds.scene("roll"), DRUM_TABLES["internal_loss"]())
        return _Played(scene, [beside.one_blow(scene)], [])
    scene = ds.scene(playing)
    return _Played(scene, ds.simulate(scene, _LASTS_S).drum_strikes(), [])


def _sound(scene: Scene, playing: str) -> Any:
    _, strikes, contacts = _played(playing)
    return render(scene, strikes, _LASTS_S, _RATE_Hz, contacts)


def _meshed(scene: Scene, accuracy: str, rate_Hz: float = 0.0) -> Scene:
    mesh = Mesh(accuracy=accuracy, rate_Hz=rate_Hz, cpu_budget=math.inf)  # pyright: ignore[reportArgumentType]
    return dataclasses.replace(scene, mesh=mesh)


def played_on_mesh(playing: str, accuracy: str, rate_Hz: float = 0.0) -> Any:
    """Sound of a shipped scene, played by its own stick on such a mesh, (n, 2)."""
    return _sound(_meshed(_played(playing).scene, accuracy, rate_Hz), playing)


def _topped(scene: Scene, top_Hz: float) -> Scene:
    assert scene.modal is not None
    return dataclasses.replace(scene, modal=dataclasses.replace(scene.modal, top_Hz=top_Hz))


def _true(scene: Scene) -> Scene:
    return _meshed(scene, "fine", REFERENCE_Hz) if scene.modal is None else _topped(scene, REFERENCE_TOP_Hz)


@cache
def _reference(playing: str) -> Any:
    return _sound(_true(_played(playing).scene), playing)


def _mode_by_mode(scene: Scene) -> list[Measure]:
    f_Hz, cents, decays = beside.mode_errors(scene, _true(scene), _LASTS_S, _RATE_Hz)
    jnds = cents / [jnd.pitch_jnd_cents(each) for each in f_Hz]
    decay = float(decays.max())
    return [
        Measure("pitch", float(cents[jnds.argmax()]), "cents", float(jnds.max())),
        Measure("decay of a mode", 100.0 * decay, "%", decay / jnd.DECAY),
    ]


def beside_exact(playing: str) -> Row:
    """Row of stage `reference`: the mesh that others are compared with, beside its head's modes in closed form."""
    scene, strikes, _ = _played(playing)
    sound = _reference(playing)
    wanted = levelled(beside.sound(scene, strikes, _LASTS_S, _RATE_Hz), sound[:, 0])
    measures = _spectra(sound, wanted[:, None]) + _mode_by_mode(scene)
    choice = f"fine, {REFERENCE_Hz:g} Hz beside modes in closed form"
    return row_of("reference", playing, choice, measures, **_costs(_true(scene)))


def _costs(scene: Scene) -> dict[str, float]:
    runs = [cost.ringing(scene, _RATE_Hz, _FRAMES) for _ in range(_RUNS)]
    return {
        "share_of_core": min(run.cpu_s for run in runs) * _RATE_Hz / _FRAMES,
        "memory_bytes": footprint.memory_bytes(scene, _RATE_Hz),
        "latency_ms": 1e3 * footprint.late_s(scene, _RATE_Hz),
    }


def _of_drum(stage: str, playing: str, choice: str, scene: Scene) -> Row:
    sound, wanted = _sound(scene, playing), _reference(playing)
    measures = _spectra(sound, wanted)
    if scene.modal is None:
        cents = estimate.of("", scene, _RATE_Hz).cents
        measures.append(Measure("pitch", cents, "cents", cents / pitch_jnd({"f01_Hz": scene.drum.f01_Hz})))
        if not scene.drum.effects:  # modes that effects couple have no decay of their own
            off = decay_off(scene)
            measures.append(Measure("decay of a mode", 100.0 * off, "%", off / jnd.DECAY))
    own, due = sound[:, 0], wanted[:, 0]
    # A fader takes away by how much a mesh is louder as a whole.
    alike_dB = spectral_distance(levelled(own, due), due, _RATE_Hz, MIDDLE_Hz)
    signed = {
        "louder_dB": louder_dB(own, due),
        "octaves_dB": brighter_dB(own, due, _RATE_Hz),
        "alike_dB": alike_dB,
    }
    return row_of(stage, playing, choice, measures, **_costs(scene)) | signed


def drums(playing: str) -> Iterator[Row]:
    """Rows of the drum of a shipped scene at each tier, or of its bank of modes at two tops."""
    scene = _played(playing).scene
    if scene.modal is not None:
        two = f"bank to {NEXT_TOP_Hz:g} Hz beside {REFERENCE_TOP_Hz:g} Hz"
        yield _of_drum("reference", playing, two, _topped(scene, NEXT_TOP_Hz))
        for top_Hz in (2000.0, scene.modal.top_Hz):
            yield _of_drum("drum", playing, f"bank to {top_Hz:g} Hz", _topped(scene, top_Hz))
        return
    if playing in PLAIN:
        yield beside_exact(playing)
    else:
        two = f"fine, {NEXT_Hz:g} Hz beside {REFERENCE_Hz:g} Hz"
        yield _of_drum("reference", playing, two, _meshed(scene, "fine", NEXT_Hz))
    for accuracy in TIERS:
        meshed = _meshed(scene, accuracy)
        rate_Hz = estimate.of(accuracy, meshed, _RATE_Hz).mesh_rate_Hz
        yield _of_drum("drum", playing, f"{accuracy}, {rate_Hz:g} Hz", meshed)


def _effects(names: tuple[str, ...]) -> Iterator[Row]:
    # What goes when one is left out, and what that saves; of its time the part of the effects tells more.
    for name in names:
        other = drum_effects.without(name)
        less = drum_effects.heard(other)
        measures = _spectra(less, drum_effects.heard(name))
        own, rest = (footprint.memory_bytes(drum_effects.scene_of(each), _RATE_Hz) for each in (name, other))
        row = row_of("effects", "two blows on the default drum", f"without {name}", measures)
        yield row | {"saves_bytes": own - rest}


def _timed(scene: Scene, stepper: Stepper | None) -> tuple[ds.Run, float]:
    begun = time.thread_time()
    run = ds.simulate(scene, _LASTS_S, stepper=stepper)
    return run, time.thread_time() - begun


def _sticks(playing: str) -> Iterator[Row]:
    scene = _played(playing).scene
    true = ds.simulate(scene, _LASTS_S)
    for stepper in (None, *_STEPPERS):
        ds.simulate(scene, 0.1, stepper=stepper)  # compiles
        runs = [_timed(scene, stepper) for _ in range(_PLAYED_TIMES)]
        run, share = runs[0][0], min(spent_s for _, spent_s in runs) / _LASTS_S
        count = min(_COMPARED, len(run.contacts))
        off_s = run.contacts["t_in_s"][:count] - true.contacts["t_in_s"][:count]
        speeds = run.contacts["v_out_m_per_s"][:count] / true.contacts["v_out_m_per_s"][:count] - 1.0
        onset_s, speed = float(np.max(np.abs(off_s))), float(np.max(np.abs(speeds)))
        measures = [
            Measure("onset", 1e3 * onset_s, "ms", onset_s / jnd.LATENCY_SPREAD_s),
            Measure("speed given back", 100.0 * speed, "%", speed / jnd.STIFFNESS),
        ]
        yield row_of(
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
        row = row_of("servo", playing, choice, measures, share_of_core=share, latency_ms=1e3 * late_s)
        yield row | {"refused": not falling.passes(scene)}


def _sent(rate_Hz: float | None) -> tuple[str, float]:
    # In words, and the share of a core for a stroke a second.
    spent = wire_cost.analytic() if rate_Hz is None else wire_cost.streamed(rate_Hz)
    words = "analytic" if rate_Hz is None else f"streamed, {rate_Hz:g} Hz"
    return words, 1e-9 * in_turn({"": spent}, 4)[""]


def _messages() -> Iterator[Row]:
    # How late each comes, a rig that plays says: stage `wire`.
    servo_Hz = float(blows.scene(False).servo.rate_Hz)
    at_s = (math.floor(0.05 * servo_Hz) + 0.5) / servo_Hz
    wanted = blow_sound(None, at_s, False)
    for rate_Hz in (None, *_STREAMS_Hz):
        sound = blow_sound(rate_Hz, at_s, rate_Hz is None)
        words, share = _sent(rate_Hz)
        yield row_of(
            "message", "a blow of the roll", words, _spectra(sound, wanted, LOW_Hz),
            share_of_core=_STROKES_Hz * share, memory_bytes=wire_cost.bytes_of(rate_Hz),
        )  # fmt: skip
    yield _of_mallet("a blow by a wooden mallet", mallet_blow.wood(), _STROKES_Hz)


def _of_mallet(playing: str, struck: mallet_blow.Struck, strokes_Hz: float) -> Row:
    measures = _spectra(mallet_blow.sound(struck, False), mallet_blow.sound(struck, True), LOW_Hz)
    share = strokes_Hz * _sent(None)[1] + mallet_blow.extra_share(struck.played)
    return row_of(
        "message", playing, "mallet", measures, share_of_core=share, memory_bytes=wire_cost.bytes_of(None)
    )


def _felt() -> Iterator[Row]:
    yield _of_mallet("a blow by a felt mallet on a timpano", mallet_blow.felt(), _TIMPANI_STROKES_Hz)


def _presses() -> Iterator[Row]:
    # A message has the contacts as an exact stick makes them; on an arm it guesses at the hand that holds it.
    wanted = render(press.scene("streamed"), [], press.LASTS_S, _RATE_Hz, press.contacts(blows.FINE_RATE_HZ))
    strikes = press.run().drum_strikes()
    for rate_Hz in (None, *_STREAMS_Hz):
        streamed = [] if rate_Hz is None else press.contacts(rate_Hz)
        words, share = _sent(rate_Hz)
        if rate_Hz is None:
            sound = render(press.scene(), strikes, press.LASTS_S, _RATE_Hz)
            strokes, each = float(len(strikes)), wire_cost.bytes_of(None)
        else:
            sound = render(press.scene("streamed"), [], press.LASTS_S, _RATE_Hz, streamed)
            # As many blows of the roll as have so many ticks.
            blow = len(blows.press_of(blows.true_impulse(), 0.0, rate_Hz).forces_N)
            strokes = sum(len(contact.forces_N) for contact in streamed) / blow
            each = wire_cost.bytes_of(rate_Hz) * strokes / len(strikes)
        row = row_of(
            "message", "a press roll", words, _spectra(sound, wanted, LOW_Hz),
            share_of_core=share * strokes / press.LASTS_S, memory_bytes=each,
        )  # fmt: skip
        yield row | {"guesses": rate_Hz is None}


def _output(playing: str) -> Iterator[Row]:
    sound = _sound(_played(playing).scene, playing)
    rounded = np.rint(32767.0 * sound) / 32767.0
    yield row_of("output", playing, "16 bits", _spectra(rounded, sound))


def _streams() -> Row:
    # Delay of a stream up to the sound card at each rate, ms, as `strike_latency` has it.
    rows = [
        {"rate_Hz": rate_Hz, "sound_ms": stream_onset.percentiles_ms(stream_onset.onsets_s(rate_Hz, _BLOCK))}
        for rate_Hz in _STREAMS_Hz
    ]
    return {"block": _BLOCK, "rows": rows}


def jobs(quick: bool, found: Row) -> Iterator[Job]:
    """Notes date, load, playings, rows, streams and yardstick_ns. Quick: the roll alone, and four effects."""
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
    yield Job("whole: messages of a press", partial(add, _presses))
    yield Job("whole: delay of a stream", lambda: found.update(streams=_streams()))
    if not quick:
        yield Job("whole: a felt mallet", partial(add, _felt))
        yield Job("whole: a head that loses more above", lambda: rows.append(beside_exact(LOSSY)))
    for playing in playings:
        yield Job(f"whole: drum of {playing}", partial(add, partial(drums, playing)))
    # Without neighbours nothing is to be heard of `sympathy`.
    names = drum_effects.QUICK if quick else tuple(name for name in MESH_EFFECTS if name != "sympathy")
    yield Job("whole: effects", partial(add, partial(_effects, names)))
    yield Job("whole: output", partial(add, partial(_output, "roll")))
    yield Job("whole: yardstick", yardstick)
