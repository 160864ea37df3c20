"""`drumstick analyse SCENE --out DIR`: every figure as PNG and SVG, every sweep as CSV, and analysis.json.

Needs matplotlib: rig.figures.requirements is asked first.
"""

import json
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from pathlib import Path

from matplotlib.figure import Figure
from rich.console import Console
from rich.progress import Progress, TaskID

from drumstick.analysis.cycles.sweep import STABLE, Axis, Swept, sweep
from drumstick.analysis.findings import Findings
from drumstick.analysis.unpulsed import NEVER_REPEATING
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from rig.figures import default_sweeps, tables
from rig.figures.bifurcation import bifurcation
from rig.figures.effective import effective, restitution
from rig.figures.phase_plane import phase_plane
from rig.figures.plane import kinds, rates
from rig.figures.players.hands import hands
from rig.figures.predictions import filling, open_forecast, predictions
from rig.figures.return_map import curves, example_throw, played, return_map
from rig.figures.style import save

_THROWS = (0.15, 0.5, 1.75)  # of the roll's speed

# Called with what is being computed, the points done and the points in all.
Report = Callable[[str, int, int], None]


class Folder:
    """Folder of the files, and those written so far."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.written: list[str] = []

    def text(self, name: str, content: str) -> None:
        """One text file. Raises OSError."""
        (self.path / name).write_text(content, encoding="utf-8")
        self.written.append(name)

    def figure(self, name: str, figure: Figure) -> None:
        """One figure, as PNG and as SVG. Raises OSError."""
        for ending in ("png", "svg"):
            save(figure, self.path / f"{name}.{ending}")
            self.written.append(f"{name}.{ending}")


@contextmanager
def _progress(quiet: bool) -> Generator[Report]:
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=quiet or not console.is_terminal) as bar:
        tasks: dict[str, TaskID] = {}

        def report(what: str, done: int, total: int) -> None:
            if what not in tasks:
                tasks[what] = bar.add_task(what, total=total)
            bar.update(tasks[what], completed=done)

        yield report


def throws_of(scene: Scene, found: Findings) -> list[float]:
    """Three throws for the phase plane, m/s: much slower than the roll, slower, faster."""
    roll = scene.hand.throw_m_per_s if found.primary is None else found.cycles[found.primary].v_e_m_per_s
    return [share * roll for share in _THROWS]


def _swept(scene: Scene, axes: Sequence[Axis], report: Report) -> Swept:
    names = " × ".join(axis.name for axis in axes)
    done: Swept | None = None
    for done in sweep(scene, axes):
        report(f"sweep over {names}", done.done, done.total)
    assert done is not None, "a sweep has at least one point"
    return done


def _write_sweep(scene: Scene, axes: Sequence[Axis], folder: Folder, report: Report) -> None:
    done = _swept(scene, axes, report)
    named = "-".join(axis.name for axis in axes)
    folder.text(f"sweep-{named}.csv", tables.swept(scene, done))
    if len(axes) == 1:
        folder.figure(f"bifurcation-{named}", bifurcation(scene, done))
        return
    if (done.kind == STABLE).any():
        folder.figure(f"rate-{named}", rates(scene, done))
    folder.figure(f"outcome-{named}", kinds(scene, done))


def _write_predictions(scene: Scene, folder: Folder, report: Report) -> None:
    line = default_sweeps.line(scene, default_sweeps.FORECAST_POINTS)
    if line is None or "pulse" not in scene.effects or any(name in scene.effects for name in NEVER_REPEATING):
        return  # equation (7) has nothing to say
    speeds = open_forecast(scene, line.values)
    for count in filling(scene, speeds):
        report("equation (7), κ and the exact cycles", count, len(line.values))
    folder.text("predictions.csv", tables.forecast(speeds))
    folder.figure("predictions", predictions(scene, speeds))


def _write_map(scene: Scene, found: Findings, folder: Folder) -> None:
    mapped = curves(scene, found.cycles)
    folder.text("return-map.csv", tables.mapped(mapped))
    throw = example_throw(scene, mapped)
    folder.figure("return-map", return_map(scene, mapped, found.cycles, played(scene, throw)))


def write(scene: Scene, found: Findings, out: Path, asked: Sequence[Axis], quiet: bool) -> list[str]:
    """Fill the folder `out`; returns the names written. `asked`: one or two axes instead of the usual sweeps.

    quiet: no progress on stderr. Raises OSError.
    """
    folder = Folder(out)
    folder.text("analysis.json", json.dumps(found.as_json(), indent=2, allow_nan=False) + "\n")
    with _progress(quiet) as report:
        if asked:
            _write_sweep(scene, asked, folder, report)
            return folder.written
        folder.figure("phase-plane", phase_plane(scene, found.cycles, throws_of(scene, found)))
        _write_map(scene, found, folder)
        folder.text("effective-restitution.csv", tables.given_back(restitution(scene)))
        folder.figure("effective-restitution", effective([scene]))
        if scene.hand.hands != 1:
            folder.figure("hands", hands([scene, parse(shipped_text("roll"), "roll")]))
        _write_predictions(scene, folder, report)
        line = default_sweeps.line(scene)
        for axes in ([] if line is None else [(line,)]) + default_sweeps.planes(scene):
            _write_sweep(scene, axes, folder, report)
    return folder.written
