"""Microphones in the air: Rayleigh's integral, its delay and its distances, against a plain sum in float64."""

import dataclasses
import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.air_constants import SOUND_M_PER_S
from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.effects.cavity import CavityTable
from drumstick.drum.engine import Engine
from drumstick.drum.membrane.heads import aligned
from drumstick.drum.memory.microphones import Packets
from drumstick.drum.memory.strikes import OfflineStrike, StrikeRing
from drumstick.drum.output.arrivals import Sending, packets_of, send_of
from drumstick.drum.render import render
from drumstick.drum.step import step
from drumstick.parameters.drum import Drum, Listen, Mesh
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import SceneError, as_tables, from_tables, parse
from machine_code import linked_within
from realtime.kernels.jit import allocations, njit

RATE = 48_000
RADIUS_M = 0.16


def scene(*microphones: tuple[float, float, float, float]) -> Scene:
    return Scene("drum", drum=Drum(f01_Hz=200.0, radius_m=RADIUS_M), listen=Listen(microphones=microphones))


def places(engine: Engine) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """The junctions inside, and x and y of each in radii."""
    grid = engine.head.grid[0]
    inside = np.flatnonzero(engine.head.weights)
    row, column = np.divmod(inside, int(grid["stride"]))
    triangular = "shifted" in engine.head.grid.dtype.names
    shift = 0.5 * ((row - int(grid["centre_row"])) & 1) if triangular else 0.0
    height = math.sqrt(0.75) if triangular else 1.0
    h = float(grid["spacing"])
    x = (column - int(grid["centre_column"]) + shift) * h
    return inside, x, (row - int(grid["centre_row"])) * height * h


FAR, NEAR, ASIDE = (0.4, -0.3, 2.5), (0.3, 0.5, 0.1), (3.0, 1.0, 0.2)
PAIR = ((-0.5, 0.6, 0.5), (0.6, 0.5, 0.5))
CASES: dict[str, tuple[tuple[tuple[float, ...], ...], dict[str, Any], dict[str, Any]]] = {
    "far": ((FAR,), {}, {}),
    "near": ((NEAR,), {}, {}),
    "aside": ((ASIDE,), {}, {}),
    "pair": (PAIR, {}, {}),
    "draft": (PAIR, {}, {"accuracy": "draft"}),
    "fine": (PAIR, {}, {"accuracy": "fine"}),
    "every sample": (PAIR, {}, {"rate_Hz": float(RATE)}),
    "odd": (PAIR, {"f01_Hz": 157.0}, {"junctions_across": 33.0}),
    "few": (PAIR, {"f01_Hz": 900.0}, {"rate_Hz": 16000.0}),
    "large": (PAIR, {"radius_m": 0.6, "f01_Hz": 120.0}, {}),
    "square": (PAIR, {}, {"topology": "rectilinear"}),
    "second head": (PAIR, {"effects": {"cavity": CavityTable()}}, {}),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.daily("near", "pair", "odd", "large")
def test_it_is_the_sum_over_the_head_each_after_its_way(case: str) -> None:
    """The very samples before the interpolator, from the very heights, by another way of summing."""
    where, changed, mesh = CASES[case]
    numbers: dict[str, Any] = {"f01_Hz": 200.0, "radius_m": RADIUS_M} | changed
    listen = Listen(microphones=tuple((*at, pan) for at, pan in zip(where, (-1.0, 1.0), strict=False)))
    tried = Scene("drum", drum=Drum(**numbers), mesh=Mesh(**mesh), listen=listen)
    ring = StrikeRing()
    engine = new_engine(tried, RATE, ring)
    ring.push(0, 0.3, 0.2, 1.0, 0.002)
    inside, x, y = places(engine)
    divisor, own_gain = int(engine.control["divisor"][0]), float(engine.control["own_gain"][0])
    neighbours = 4.0 if case == "square" else 6.0
    weight = 1.0 / (neighbours * engine.head.weights[inside].astype(float) / own_gain)
    steps = 400
    velocity, heard = np.zeros((steps, len(inside))), np.zeros((2, steps))
    before = engine.head.time_levels[int(engine.control["present_level"][0])][inside].astype(float)
    out = np.zeros((divisor, 2), np.float32)
    for k in range(steps):
        render_all(engine, out, divisor, 0)
        now = engine.head.time_levels[int(engine.control["present_level"][0])][inside].astype(float)
        velocity[k], before = now - before, now
        heard[:, k] = engine.history[:, int(engine.control["history_head"][0])]
    for (at_x, at_y, at_z), channel in zip(where, heard, strict=False):
        distance = np.sqrt((x - at_x) ** 2 + (y - at_y) ** 2 + at_z**2)
        late = distance * numbers["radius_m"] / SOUND_M_PER_S * RATE / divisor
        # Each junction's velocity, later by a time that falls between two steps.
        whole = np.floor(late).astype(int)
        flow = np.zeros(steps + whole.max() + 2)
        for k in range(steps):
            np.add.at(flow, k + whole, weight / distance * (1.0 - (late - whole)) * velocity[k])
            np.add.at(flow, k + whole + 1, weight / distance * (late - whole) * velocity[k])
        ideal = np.diff(np.concatenate([[0.0], flow]))[:steps]
        assert np.abs(ideal).max() > 0.0
        # What arrives is rounded to float32, and heard as its change: sixteen roundings. The order of the sum follows
        # the machine's vectors; eleven were seen.
        assert channel == pytest.approx(ideal, abs=1e-6 * np.abs(flow).max())


@pytest.mark.parametrize("width", [4, 8, 16])
def test_every_width_sums_the_same(width: int) -> None:
    """Delays far apart within a vector, too, and vectors of which most is empty."""
    chance = np.random.default_rng(width)
    late = np.repeat(chance.uniform(0.0, 40.0, 20), 16) + chance.uniform(0.0, 7.0, 320)
    nearness = np.where(chance.uniform(size=320) < 0.6, chance.uniform(0.1, 1.0, 320), 0.0)
    u, u_new, line = aligned((320,)), aligned((320,)), aligned((1, 64, width))
    u[:], u_new[:] = chance.standard_normal((2, 320))
    packets, longest = packets_of(late, nearness, width)
    weights = aligned(packets.weights.shape)
    weights[:] = packets.weights
    send = send_of(width)

    @njit()
    def run(u: Any, u_new: Any, packets: Packets, line: Any) -> None:
        send(u, u_new, packets, line, Sending(0, packets.delays.shape[0], 0, line.shape[1] - 1, 50))

    run(u, u_new, Packets(packets.delays, packets.places, weights), line)
    whole, moved = np.floor(late).astype(int), nearness * (u_new.astype(float) - u)
    ideal = np.zeros(64)
    np.add.at(ideal, (50 + whole) % 64, (1.0 - (late - whole)) * moved)
    np.add.at(ideal, (51 + whole) % 64, (late - whole) * moved)
    assert longest == whole[nearness > 0.0].max() + 1
    assert line[0].astype(float).sum(axis=1) == pytest.approx(ideal, abs=1e-5)


def test_a_microphone_allocates_nothing_while_it_plays() -> None:
    ring = StrikeRing()
    engine = new_engine(scene((*PAIR[0], -0.6), (*PAIR[1], 0.6)), RATE, ring)
    out = np.zeros((4800, 2), np.float32)
    render_all(engine, out[:128], 128, 0)
    counts: list[int] = []
    for frames in (128, 4800):
        ring.push(0, 0.3, 0.2, 1.0, 0.002)
        before = allocations()
        render_all(engine, out[:frames], 128, 0)
        counts.append(allocations() - before)
    assert counts[0] == counts[1]
    assert out.any()


def test_only_a_scene_with_microphones_has_their_code() -> None:
    def linked(listen: Listen) -> bool:
        engine = new_engine(dataclasses.replace(scene(), listen=listen), RATE, StrikeRing())
        names = linked_within(step, engine, 0)
        return any("output.microphones.captured" in name and "absent" not in name for name in names)

    assert linked(Listen(microphones=((*FAR, 0.0),)))
    assert not linked(Listen())


def onset_s(sound: npt.NDArray[np.float32]) -> float:
    level = np.abs(sound).max()
    return float(np.flatnonzero(np.abs(sound) > 0.02 * level)[0]) / RATE


def test_distance_delays_and_weakens() -> None:
    blow = OfflineStrike(0.0, 0.0, 0.0, 5.0, 0.0005)
    far_m, near_m = 20.0 * RADIUS_M, 5.0 * RADIUS_M
    both = render(scene((0.0, 0.0, 5.0, -1.0), (0.0, 0.0, 20.0, 1.0)), [blow], 0.2, RATE)
    delay_s = onset_s(both[:, 1]) - onset_s(both[:, 0])
    assert delay_s == pytest.approx((far_m - near_m) / SOUND_M_PER_S, abs=1e-4)
    near, far = np.sqrt(np.mean(both.astype(np.float64) ** 2, axis=0))  # a peak is where modes happen to meet
    assert near / far == pytest.approx(4.0, rel=0.05)


def test_above_the_middle_only_round_modes_are_heard() -> None:
    """By symmetry; a microphone at the side hears the others too."""
    blow = [OfflineStrike(0.0, 0.6, 0.0, 5.0, 0.001)]
    for x, round_only in ((0.0, True), (3.0, False)):
        sound = render(scene((x, 0.0, 3.0, -1.0)), blow, 1.2, RATE)[RATE // 10 :, 0].astype(float)
        spectrum = np.abs(np.fft.rfft(sound * np.hanning(len(sound))))
        f = np.fft.rfftfreq(len(sound), 1.0 / RATE)
        first, second = (spectrum[np.abs(f - f_Hz) < 6.0].max() for f_Hz in (200.0, 200.0 * 3.8317 / 2.4048))
        assert (second < 1e-2 * first) == round_only


def test_pickups_are_not_heard_besides_and_a_drum_without_has_none() -> None:
    assert len(new_engine(scene((0.0, 0.0, 2.0, 0.0)), RATE, StrikeRing()).pickups) == 0
    plain = new_engine(dataclasses.replace(scene(), listen=Listen()), RATE, StrikeRing())
    assert plain.microphones is None
    assert len(plain.pickups) > 0


def test_silence_comes_back_and_nothing_stays_on_its_way() -> None:
    ring = StrikeRing()
    short = scene((0.0, 0.0, 40.0, 0.0))
    engine = new_engine(dataclasses.replace(short, drum=Drum(f01_Hz=400.0, t60_s=0.05)), RATE, ring)
    ring.push(0, 0.3, 0.2, 1.0, 0.002)
    out = np.zeros((2 * RATE, 2), np.float32)
    render_all(engine, out, 128, 0)
    assert np.abs(out).max() > 0.0
    assert engine.microphones is not None
    assert not engine.microphones.line.any()
    assert engine.control["asleep"][0] == 1


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("[[0, 0, 0.05, 0]]", "number 1 is 0.05 radii above the head, less than 0.1"),
        ("[[0, 0, 1, 0], [0, 0, 1, 1.5]]", "number 2 has the pan 1.5, outside -1 .. 1"),
        ("[[0, 0, 60, 0]]", "60 of the radius; pan -1 left .. 1 right is outside -50 .. 50"),
        ("3", "3 must be a list of 0 to 16 rows of 4 numbers"),
    ],
)
def test_what_no_microphone_can_be_is_refused(rows: str, words: str) -> None:
    with pytest.raises(SceneError, match=r"a:2: listen\.microphones: ") as refused:
        parse(f"[listen]\nmicrophones = {rows}\n", "a")
    assert words in str(refused.value)


def test_microphones_survive_the_wire() -> None:
    kept = scene((0.0, 1.0, 2.0, 0.5))
    assert from_tables(as_tables(kept)) == kept
    assert from_tables(as_tables(Scene("plain"))) == Scene("plain")
