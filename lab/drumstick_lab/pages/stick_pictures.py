"""The pictures of docs/stick.md, and whether they are still those of the code. Imported by stick_page.py.

A picture takes up to half a minute to compute, so a test cannot make it anew. Each PNG carries a digest of what it was
made from instead: the scene's text, what was asked for, and the source of the drawing.
"""

import hashlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from drumstick.analysis.cycles.sweep import Axis, Swept, sweep
from drumstick.analysis.findings import analyse
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_gesture, shipped_text
from drumstick_lab.checkout import DOCS
from drumstick_lab.pages.stored_picture import COLOURS, digest_of, store
from rig import figures
from rig.figures.bifurcation import bifurcation
from rig.figures.effective import effective
from rig.figures.phase_plane import phase_plane
from rig.figures.plane import kinds, rates
from rig.figures.players.grip import grip
from rig.figures.players.hands import hands
from rig.figures.players.steadying import steadying
from rig.figures.predictions import filling, open_forecast, predictions
from rig.figures.return_map import curves, example_throw, played, return_map
from rig.figures.style import DPI
from rig.figures.write import throws_of

IMAGES = DOCS / "images"
_PLANE = 61
_SOURCES = (
    "bifurcation",
    "effective",
    "heading",
    "phase_plane",
    "plane",
    "predictions",
    "return_map",
    "style",
)


class Picture(NamedTuple):
    """One file of docs/images: stick-NAME.png, of which scene, how it is drawn, and what is in it besides the scene."""

    name: str
    scene: str
    draw: Callable[[Scene], Figure]
    asked: tuple[Axis, ...] = ()
    drawn_by: tuple[str, ...] = ()  # modules beside those of every picture


def _all_of(steps: Iterator[Swept]) -> Swept:
    *_, done = steps
    return done


def _phase_plane(scene: Scene) -> Figure:
    found = analyse(scene)
    return phase_plane(scene, found.cycles, throws_of(scene, found))


def _return_map(scene: Scene) -> Figure:
    cycles = analyse(scene).cycles
    mapped = curves(scene, cycles)
    return return_map(scene, mapped, cycles, played(scene, example_throw(scene, mapped)))


def _effective(scene: Scene) -> Figure:
    return effective([scene, *(parse(shipped_text(name), name) for name in ("cor-literal", "cor-roll"))])


def _hands(scene: Scene) -> Figure:
    return hands([scene, parse(shipped_text("roll"), "roll")])


def _steadying(scene: Scene) -> Figure:
    other = parse(shipped_text("cor-literal"), "cor-literal")
    return steadying([(scene, 3.0), (scene, 5.0), (other, 5.0), (other, 8.0)])


def _predictions(dv: Axis) -> Callable[[Scene], Figure]:
    def draw(scene: Scene) -> Figure:
        speeds = open_forecast(scene, dv.values)
        for _ in filling(scene, speeds):
            pass
        return predictions(scene, speeds)

    return draw


def _line(axis: Axis) -> Callable[[Scene], Figure]:
    return lambda scene: bifurcation(scene, _all_of(sweep(scene, [axis], settle=2000)))


def _plane(figure: Callable[[Scene, Swept], Figure], across: Axis, up: Axis) -> Callable[[Scene], Figure]:
    return lambda scene: figure(scene, _all_of(sweep(scene, [across, up], settle=2000)))


def pictures() -> list[Picture]:
    """Every picture of the page."""
    speeds = {
        "roll": Axis("dv_pls", np.geomspace(0.05, 1.0, 48)),
        "paper-roll": Axis("dv_pls", np.geomspace(0.15, 3.0, 48)),
    }
    doubling = Axis("dv_pls", np.geomspace(0.17, 0.4, 400))
    hand, height = (
        Axis("k_hand", np.geomspace(5.0, 200.0, _PLANE)),
        Axis("z_h0", np.linspace(-0.03, 0.005, _PLANE)),
    )
    found = [
        *(Picture(f"{name}-phase-plane", name, _phase_plane) for name in speeds),
        *(Picture(f"{name}-return-map", name, _return_map) for name in ("roll", "paper-roll", "cor-roll")),
        *(Picture(f"{name}-predictions", name, _predictions(dv), (dv,)) for name, dv in speeds.items()),
        Picture("paper-roll-bifurcation", "paper-roll", _line(doubling), (doubling,)),
        Picture("roll-effective", "roll", _effective),
        Picture("double-stroke-hands", "double-stroke", _hands, drawn_by=("players/hands",)),
        Picture("cor-roll-steadying", "cor-roll", _steadying, drawn_by=("players/steadying",)),
        Picture("grip-rate", "grip", grip, drawn_by=("players/grip",)),
        Picture("roll-rate", "roll", _plane(rates, hand, height), (hand, height)),
    ]
    for name, dv in speeds.items():
        across = Axis("dv_pls", np.geomspace(dv.values[0], dv.values[-1], _PLANE))
        found.append(Picture(f"{name}-outcome", name, _plane(kinds, across, hand), (across, hand)))
    return found


def _digest(picture: Picture) -> str:
    made_from = hashlib.sha256(f"{picture.name} {COLOURS} {DPI}\n{shipped_text(picture.scene)}".encode())
    if gesture := parse(shipped_text(picture.scene), picture.scene).hand.gesture_file:
        made_from.update(shipped_gesture(gesture).encode())
    for axis in picture.asked:
        made_from.update(f"{axis.name} {axis.values.tolist()}".encode())
    for name in (*_SOURCES, *picture.drawn_by):
        made_from.update((Path(figures.__path__[0]) / f"{name}.py").read_bytes())
    return made_from.hexdigest()[:16]


def _path(picture: Picture) -> Path:
    return IMAGES / f"stick-{picture.name}.png"


def stale() -> list[Picture]:
    """The pictures that are missing, or were made from something else."""
    return [picture for picture in pictures() if digest_of(_path(picture)) != _digest(picture)]


def write(picture: Picture) -> None:
    """Draw it and write its file."""
    scene = parse(shipped_text(picture.scene), picture.scene)
    store(picture.draw(scene), _path(picture), _digest(picture))
