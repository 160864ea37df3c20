"""Cost of a junction: drumstick lab mesh-kernel [--rounds 60].

The triangular mesh of N junctions across: our step against the same step in C (mesh_kernel.c, gcc -O3 -march=native
and, to be fair to it, -Ofast with the widest vectors too) and against ours with eight steps in one pass; several large
drums by turns, beside one; our step with each of the drum's effects, with air at several pitches, and with microphones,
beside the same microphones as plain loops. Thread CPU time, windows of some milliseconds in turn, the best of each. All must come
to the same heights and sounds, or the script stops. The orders of the scheme are compared at the same rate, with effects
that its sweeps know of and without.
"""

import argparse
import ctypes
import dataclasses
import math
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from drumstick.drum import estimate
from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.effects.registry import DRUM_TABLES, MESH_EFFECTS, NEEDS
from drumstick.drum.engine import Engine
from drumstick.drum.membrane.lattice import lattice_of
from drumstick.drum.membrane.simd import WIDTH
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.step import step, wake
from drumstick.parameters.scene import Scene
from drumstick_lab.benchmarks.sound.bare_mesh import RATE_HZ, WAVE, BareMesh, start, timed
from drumstick_lab.benchmarks.sound.plain_microphones import (
    PlainMicrophones,
    captured_after,
    plain_microphones,
)
from drumstick_lab.measuring import stored
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.float_mode import flush_denormals, restore
from realtime.kernels.jit import njit
from realtime.records import ABSENT, is_there

HERE = Path(__file__).parent

ACROSS = (16, 32, 64, 128, 256, 512)
TOGETHER, TOGETHER_HZ, BLOCK = (1, 2, 4, 8), 48_000.0, 256
WINDOW_UPDATES = 4e6
# x, y, height in radii; pan. The middle ones: left and right together are then sqrt(2) times what a microphone hears.
_MICROPHONES = ((0.3, 0.0, 1.0, 0.0), (-0.3, 0.0, 1.0, 0.0))
_MESH_RATES_HZ = (16_000.0, 48_000.0)
_AIR_HZ = (80.0, 150.0, 220.0, 300.0)
FLAGS = {
    "gcc -O3": ["-O3", "-march=native"],
    "gcc -Ofast": ["-Ofast", "-march=native", "-mprefer-vector-width=512"],
}
OF_BOTH_ORDERS = ("none", "internal_loss", "tension", "cavity")
Window = Callable[[int], None]


@njit()
def _steps(engine: Engine, steps: int) -> None:
    engine = borrowed_view(engine)
    mode = flush_denormals()
    for _ in range(steps):
        step(engine)
    restore(mode)


def built(flags: list[str], folder: Path) -> ctypes.CDLL:
    out = folder / f"{len(list(folder.iterdir()))}.so"
    subprocess.run(
        ["gcc", *flags, "-shared", "-fPIC", "-o", str(out), str(HERE / "mesh_kernel.c")], check=True
    )
    return ctypes.CDLL(str(out))


def kernels(across: int, rounds: int, libraries: dict[str, ctypes.CDLL]) -> dict[str, Any]:
    mesh = BareMesh(across)
    lattice, head = mesh.lattice, mesh.head
    steps = WAVE * max(2, round(WINDOW_UPDATES / lattice.junctions / WAVE))

    def theirs(library: ctypes.CDLL) -> Window:
        pointer = ctypes.c_void_p

        def call(n: int) -> None:
            library.run(
                *(pointer(a.ctypes.data) for a in (*head.time_levels, head.weights, lattice.spans)),
                *(
                    ctypes.c_int(v)
                    for v in (len(lattice.spans), lattice.weights.shape[1], lattice.centre_row)
                ),
                ctypes.c_float(float(mesh.u_gain)),
                ctypes.c_float(float(mesh.u_old_gain)),
                ctypes.c_int(n),
            )

        return call

    calls: dict[str, Window] = {"ours": mesh.run, "in waves": mesh.run_in_waves}
    calls |= {name: theirs(library) for name, library in libraries.items()}
    ends: dict[str, Any] = {}
    for name, call in calls.items():
        start(head)
        call(3 * WAVE)
        ends[name] = head.time_levels.copy()
        assert np.allclose(ends[name], ends["ours"], rtol=1e-3, atol=1e-6), name
    best = dict.fromkeys(calls, math.inf)
    start(head)
    for _ in range(rounds):
        for name, call in calls.items():
            best[name] = min(best[name], timed(lambda call=call: call(steps)))
    ns = {name: spent / steps / lattice.junctions * 1e9 for name, spent in best.items()}
    return {
        "across": across,
        "junctions": lattice.junctions,
        "ns": ns,
        "gcc_over_ours": min(ns[name] for name in libraries) / ns["ours"],
    }


@njit()
def _steps_and_plain(engine: Engine, air: PlainMicrophones, steps: int) -> None:
    engine, air = borrowed_view(engine), borrowed_view(air)
    mode = flush_denormals()
    for _ in range(steps):
        step(engine)
        captured_after(engine, air)
    restore(mode)


@njit()
def _heard(engine: Engine, air: PlainMicrophones, out: Any) -> None:
    engine, air = borrowed_view(engine), borrowed_view(air)
    for k in range(out.shape[0]):
        out[k, 0] = step(engine)[0]
        out[k, 1] = captured_after(engine, air)


def _drum(effects: dict[str, Any], microphones: int = 0, **mesh: Any) -> Scene:
    scene = Scene("drum")
    scene = dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, effects=effects, t60_s=20.0))
    listen = dataclasses.replace(scene.listen, microphones=_MICROPHONES[:microphones])
    return dataclasses.replace(scene, mesh=dataclasses.replace(scene.mesh, **mesh), listen=listen)


def _engine(scene: Scene) -> Engine:
    engine = new_engine(scene, RATE_HZ, StrikeRing())
    if is_there(engine.effects.tension):
        engine.effects.tension.state["kappa"] = 1e3 * engine.effects.tension.state["q_most"]
    start(engine.head)
    return engine


def _with_needed(name: str) -> list[str]:
    needed = NEEDS.get(name)
    return [*(_with_needed(needed[0]) if needed else ()), name]


def effects(rounds: int) -> dict[str, Any]:
    """ns a step of the shipped drum with each effect, and with those that it needs: `cavity`, `snare` and `sympathy` are a second head too."""
    named: dict[str, dict[str, Any]] = {"none": {}}
    for name in MESH_EFFECTS:
        named[name] = {each: DRUM_TABLES[each]() for each in _with_needed(name)}
    engines = {name: _engine(_drum(tables)) for name, tables in named.items()}
    ns = _ns_per_step(engines, rounds)
    return {name: {"ns_per_step": value, "ratio": value / ns["none"]} for name, value in ns.items()}


def air(rounds: int) -> list[dict[str, Any]]:
    """ns a step of the drum in air at several f01; times one of that f01 without, and times its own mesh without."""
    rows: list[dict[str, Any]] = []
    for f01_Hz in _AIR_HZ:
        scenes = [_drum({"air": DRUM_TABLES["air"]()}), _drum({})]
        scenes = [dataclasses.replace(s, drum=dataclasses.replace(s.drum, f01_Hz=f01_Hz)) for s in scenes]
        ours, without, bare = (_engine(scene) for scene in (*scenes, scenes[0]))
        bare = bare._replace(effects=bare.effects._replace(air=ABSENT))
        ns = _ns_per_step({"air": ours, "f01": without, "mesh": bare}, rounds)
        rows.append(
            {
                "f01_Hz": f01_Hz,
                "junctions": int(np.count_nonzero(ours.head.weights)),
                "ns_per_step": ns["air"],
                "of_same_f01": ns["air"] / ns["f01"],
                "of_same_mesh": ns["air"] / ns["mesh"],
            }
        )
    return rows


def _ns_per_step(engines: dict[Any, Engine], rounds: int) -> dict[Any, float]:
    for engine in engines.values():
        _steps(engine, 10)
    best = dict.fromkeys(engines, math.inf)
    steps = 1000
    for _ in range(rounds):
        for name, engine in engines.items():
            best[name] = min(best[name], timed(lambda engine=engine: _steps(engine, steps)))
    return {name: spent / steps * 1e9 for name, spent in best.items()}


def together(rounds: int) -> list[dict[str, Any]]:
    """ns of each of some drums, a block of each in turn, per junction and step: does one's memory drive out another's?"""
    rows: list[dict[str, Any]] = []
    for count in TOGETHER:
        engines = [_engine(_drum({}, rate_Hz=TOGETHER_HZ)) for _ in range(count)]
        out = np.zeros((BLOCK, 2), np.float32)

        def in_turn(engines: list[Engine] = engines, out: Any = out) -> None:
            for engine in engines:
                render_all(engine, out, BLOCK, 0)

        for engine in engines:
            wake(engine)
        in_turn()
        best = min(timed(in_turn) for _ in range(rounds))
        junctions = int(np.count_nonzero(engines[0].head.weights))
        rows.append(
            {
                "drums": count,
                "block": BLOCK,
                "junctions": junctions,
                "ns": best * 1e9 / count / BLOCK / junctions,
            }
        )
    return rows


def orders(rounds: int) -> list[dict[str, Any]]:
    """ns a step of the shipped drum by each order at the same rate, and what the first twenty modes are told to be off."""
    rows: list[dict[str, Any]] = []
    for names in (*((name,) for name in OF_BOTH_ORDERS), tuple(OF_BOTH_ORDERS)):
        tables = {name: DRUM_TABLES[name]() for name in names if name != "none"}
        drums = {name: _drum(tables, rate_Hz=RATE_HZ / 3.0, accuracy=name) for name in ("standard", "fine")}
        ns = _ns_per_step({name: _engine(drum) for name, drum in drums.items()}, rounds)
        cents = {name: estimate.of(name, drum, RATE_HZ).cents for name, drum in drums.items()}
        rows.append(
            {"effects": [*tables], "cents": cents, "ns_per_step": ns, "ratio": ns["fine"] / ns["standard"]}
        )
    return rows


def microphones(rate_Hz: float, rounds: int) -> dict[str, Any]:
    """ns of a step without microphones, and of each of one or two, ours and plain, per junction and step."""
    scenes = [_drum({}, count, rate_Hz=rate_Hz) for count in range(len(_MICROPHONES) + 1)]
    engines = [_engine(scene) for scene in scenes]
    bare, step_s = engines[0], 1.0 / rate_Hz
    lattice = lattice_of(float(bare.head.grid["spacing"][0]))
    plain = [plain_microphones(scene, lattice, step_s) for scene in scenes[1:]]
    for engine, air in zip(engines[1:], plain, strict=True):
        out = np.zeros((500, 2))
        _heard(engine, air, out)
        assert np.allclose(out[:, 0], out[:, 1] * math.sqrt(0.5), atol=2e-5 * np.abs(out).max())
    calls: list[Window] = [lambda n, engine=engine: _steps(engine, n) for engine in engines]
    calls += [lambda n, air=air: _steps_and_plain(bare, air, n) for air in plain]
    best, steps = [math.inf] * len(calls), max(10, round(WINDOW_UPDATES / lattice.junctions))
    for call in calls:
        call(10)
    for _ in range(rounds):
        for at, call in enumerate(calls):
            best[at] = min(best[at], timed(lambda call=call: call(steps)))
    ns = [spent / steps / lattice.junctions * 1e9 for spent in best]
    rows = [
        {"microphones": count, "ours": (ours - ns[0]) / count, "plain": (theirs - ns[0]) / count}
        for count, ours, theirs in zip((1, 2), ns[1:3], ns[3:], strict=True)
    ]
    for row in rows:
        row["plain_over_ours"] = row["plain"] / row["ours"]
    return {"rate_Hz": rate_Hz, "junctions": lattice.junctions, "step_ns": ns[0], "rows": rows}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=60)
    rounds = parser.parse_args().rounds
    with tempfile.TemporaryDirectory() as folder:
        libraries = {name: built(flags, Path(folder)) for name, flags in FLAGS.items()}
        rows = []
        for across in ACROSS:
            rows.append(kernels(across, rounds, libraries))
            print(rows[-1])
    found = effects(rounds)
    for name, row in found.items():
        print(f"{name:15s} {row['ns_per_step']:8.0f} ns a step, {row['ratio']:.2f} of none")
    in_air = air(rounds)
    for row in in_air:
        print(row)
    beside = together(rounds)
    for row in beside:
        print(row)
    heard = [microphones(rate_Hz, rounds) for rate_Hz in _MESH_RATES_HZ]
    for row in heard:
        print(row)
    both = orders(rounds)
    for row in both:
        print(f"{'+'.join(row['effects']) or 'none':30s} fourth order {row['ratio']:.2f} of second")
    gcc = subprocess.run(
        ["gcc", "--version"], capture_output=True, text=True, check=True
    ).stdout.splitlines()[0]
    result = {
        "gcc": gcc,
        "rounds": rounds,
        "lanes": WIDTH,
        "kernels": rows,
        "effects": found,
        "air": in_air,
        "together": beside,
        "microphones": heard,
        "orders": both,
    }
    stored.store("mesh_kernel", result)


if __name__ == "__main__":
    main()
