"""Cost of a junction: drumstick lab mesh-kernel [--rounds 60].

The triangular mesh of N junctions across: our step against the same step in C (mesh_kernel.c, gcc -O3 -march=native
and, to be fair to it, with -ffast-math too), and our step with each of the drum's effects. Thread CPU time, windows of
some milliseconds in turn, the best of each. All must come to the same heights, or the script stops. The orders of
the scheme are compared at the same rate, with effects that its sweeps know of and without.
"""

import argparse
import ctypes
import dataclasses
import json
import math
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from drumstick.drum import estimate
from drumstick.drum.build import new_engine
from drumstick.drum.effects.registry import DRUM_TABLES, MESH_EFFECTS
from drumstick.drum.engine import Engine
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.step import step
from drumstick.parameters.scene import Scene
from drumstick_lab.benchmarks.sound.bare_mesh import RATE_HZ, BareMesh, start, timed
from drumstick_lab.checkout import RESULTS
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.float_mode import flush_denormals, restore
from realtime.kernels.jit import njit
from realtime.records import is_there
from rig.machine.this_machine import description

HERE = Path(__file__).parent

RESULT = RESULTS / "mesh_kernel.json"
ACROSS = (16, 32, 64, 128, 256)
WINDOW_UPDATES = 4e6
_MICROPHONES = ((0.3, 0.0, 1.0, 0.0), (-0.3, 0.0, 1.0, 0.0))  # x, y, height in radii; pan
FLAGS = {"gcc -O3": ["-O3", "-march=native"], "gcc -O3 -ffast-math": ["-O3", "-march=native", "-ffast-math"]}
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
    steps = 2 * max(10, round(WINDOW_UPDATES / lattice.junctions / 2))

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

    calls: dict[str, Window] = {"ours": mesh.run}
    calls |= {name: theirs(library) for name, library in libraries.items()}
    ends: dict[str, Any] = {}
    for name, call in calls.items():
        start(head)
        call(20)
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
        "gcc_over_ours": {name: ns[name] / ns["ours"] for name in libraries},
    }


def _drum(effects: dict[str, Any], **mesh: Any) -> Scene:
    scene = Scene("drum")
    scene = dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, effects=effects, t60_s=20.0))
    return dataclasses.replace(scene, mesh=dataclasses.replace(scene.mesh, **mesh))


def _engine(scene: Scene, microphones: int = 0) -> Engine:
    listen = dataclasses.replace(scene.listen, microphones=_MICROPHONES[:microphones])
    scene = dataclasses.replace(scene, listen=listen)
    engine = new_engine(scene, RATE_HZ, StrikeRing())
    if is_there(engine.effects.tension):
        engine.effects.tension.state["kappa"] = 1e3 * engine.effects.tension.state["q_most"]
    start(engine.head)
    return engine


def effects(rounds: int) -> dict[str, Any]:
    """ns a step of the shipped drum with each effect or with microphones; `snare`, `cavity` are a second head too."""
    named: dict[str, dict[str, Any]] = {"none": {}}
    for name in MESH_EFFECTS:
        named[name] = {name: DRUM_TABLES[name]()}
    named["snare"]["cavity"] = DRUM_TABLES["cavity"]()
    engines = {name: _engine(_drum(tables)) for name, tables in named.items()}
    engines |= {"one microphone": _engine(_drum({}), 1), "two microphones": _engine(_drum({}), 2)}
    ns = _ns_per_step(engines, rounds)
    return {name: {"ns_per_step": value, "ratio": value / ns["none"]} for name, value in ns.items()}


def _ns_per_step(engines: dict[Any, Engine], rounds: int) -> dict[Any, float]:
    for engine in engines.values():
        _steps(engine, 10)
    best = dict.fromkeys(engines, math.inf)
    steps = 1000
    for _ in range(rounds):
        for name, engine in engines.items():
            best[name] = min(best[name], timed(lambda engine=engine: _steps(engine, steps)))
    return {name: spent / steps * 1e9 for name, spent in best.items()}


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
    both = orders(rounds)
    for row in both:
        print(f"{'+'.join(row['effects']) or 'none':30s} fourth order {row['ratio']:.2f} of second")
    gcc = subprocess.run(
        ["gcc", "--version"], capture_output=True, text=True, check=True
    ).stdout.splitlines()[0]
    result = {
        "machine": description(),
        "gcc": gcc,
        "rounds": rounds,
        "kernels": rows,
        "effects": found,
        "orders": both,
    }
    RESULT.write_text(json.dumps(result, indent=1, allow_nan=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
