"""Figures and tables of the stick's analysis: what is drawn and written is what was computed."""

import csv
import dataclasses
import io
import json
import math
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.image import imread

from drumstick.analysis.cycles.sweep import KINDS, MEASURED, STABLE, Axis, Swept, sweep
from drumstick.analysis.findings import analyse
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.simulate import simulate
from rig.exit_status import GIVEN, LACKING, CommandError
from rig.figures import default_sweeps, requirements, sweep_option, tables
from rig.figures.bifurcation import bifurcation
from rig.figures.heading import axis_label, effect_words, own_value, scale_of
from rig.figures.phase_plane import cycle_path, phase_plane
from rig.figures.plane import kinds, rates
from rig.figures.predictions import branches, filling, open_forecast, predictions
from rig.figures.return_map import curves, example_throw, return_map
from rig.figures.return_map import played as played_from
from rig.figures.style import BLUE, HEAD, INK, save
from rig.offline.analyse import analyse as analyse_command
from stick_cases import STICK_A, scene

ROLL = scene(STICK_A, Pulse(0.2, 0.002, "exit", 1))
TWO_CYCLES = scene(Stick(0.075, 3500.0, 2.5, 60.0, 0.5, -0.01, "unilateral"), Pulse(0.06, 0.004, "exit", 1))
SCENES = {
    "roll": ROLL,
    "paper": scene(STICK_A, Pulse(1.0, 0.002, "entry", 1)),
    "no pulse": scene(STICK_A),
    "a pulse of nothing": scene(STICK_A, Pulse(0.0, 0.002, "exit", 1)),
    "overdamped": scene(dataclasses.replace(STICK_A, r_in_N_s_per_m=40.0), Pulse(0.2, 0.002, "exit", 1)),
    "overdamped, unilateral": scene(
        dataclasses.replace(STICK_A, r_in_N_s_per_m=40.0, release="unilateral"), Pulse(0.2, 0.002, "exit", 1)
    ),
    "held above the head": scene(dataclasses.replace(STICK_A, z_ss_m=0.02, r_out_N_s_per_m=1.0)),
    "no hand": scene(dataclasses.replace(STICK_A, k_hand_N_per_m=0.0)),
}
EVERY = pytest.mark.parametrize("played", SCENES.values(), ids=SCENES.keys())


def last_of(played: Scene, axes: list[Axis], settle: int = 40) -> Swept:
    *_, done = sweep(played, axes, settle)
    return done


def few(axis: Axis | None, points: int = 6) -> Axis:
    assert axis is not None
    return Axis(axis.name, axis.values[np.linspace(0, len(axis.values) - 1, points).astype(int)])


def drawn(figure: Figure, folder: Path) -> int:
    """Saves the figure as PNG and as SVG; how many colours the PNG has."""
    for ending in ("png", "svg"):
        save(figure, folder / f"figure.{ending}")
    assert (folder / "figure.svg").read_text(encoding="utf-8").count("<path") > 10
    pixels = imread(folder / "figure.png")
    return len(np.unique((pixels * 255).astype(np.uint8).view(np.uint32)))


@EVERY
@pytest.mark.daily("roll")
def test_the_phase_plane_and_the_return_map_of_any_scene(played: Scene, tmp_path: Path):
    cycles = analyse(played).cycles
    assert drawn(phase_plane(played, cycles, (0.02, 0.4, 1.1)), tmp_path) > 50
    mapped = curves(played, cycles)
    assert (
        drawn(
            return_map(played, mapped, cycles, played_from(played, example_throw(played, mapped))), tmp_path
        )
        > 20
    )


def test_the_cycle_in_the_phase_plane_closes_and_is_the_settled_roll():
    (cycle,) = analyse(ROLL).cycles
    path = cycle_path(ROLL, cycle)
    last = simulate(ROLL, 20.0, 0.4).contacts[-1]
    assert path.z_m[0] == pytest.approx(path.z_m[-1], abs=1e-9)
    assert path.v_m_per_s[0] == pytest.approx(path.v_m_per_s[-1], abs=1e-8)
    assert path.z_m.min() == pytest.approx(last[7], rel=1e-4)
    figure = phase_plane(ROLL, [cycle], (0.4,))
    lines = [line for line in figure.axes[0].lines if line.get_label() == "limit cycle"]
    assert len(lines) == 1
    np.testing.assert_array_equal(lines[0].get_xdata(), path.z_m * 1e3)
    np.testing.assert_array_equal(lines[0].get_ydata(), path.v_m_per_s)
    assert to_hex(lines[0].get_color()) == BLUE.lower()
    assert any(to_hex(patch.get_facecolor()) == HEAD for patch in figure.axes[0].patches)


def test_an_unstable_cycle_is_drawn_too():
    unstable, stable = analyse(TWO_CYCLES).cycles
    assert (unstable.stable, stable.stable) == (False, True)
    path = cycle_path(TWO_CYCLES, unstable)
    assert path.v_m_per_s[0] == pytest.approx(path.v_m_per_s[-1], abs=1e-8)
    labels = [line.get_label() for line in phase_plane(TWO_CYCLES, [unstable, stable], ()).axes[0].lines]
    assert labels.count("limit cycle") == labels.count("unstable cycle") == 1
    mapped = return_map(TWO_CYCLES, curves(TWO_CYCLES, [stable]), [unstable, stable], np.zeros(0))
    circles = [line for line in mapped.axes[0].lines if line.get_marker() == "o"]
    assert [to_hex(line.get_markerfacecolor()) for line in circles] == ["#ffffff", INK]
    assert [line.get_xdata()[0] for line in circles] == [unstable.v_e_m_per_s, stable.v_e_m_per_s]


def test_the_return_map_meets_the_identity_at_the_cycle_and_ends_where_throws_are_captured():
    found = analyse(ROLL)
    mapped = curves(ROLL, found.cycles)
    assert np.interp(found.cycles[0].v_e_m_per_s, mapped.v_e, mapped.rolling - mapped.v_e) == pytest.approx(
        0.0, abs=1e-5
    )
    edge = mapped.v_e[mapped.captured].max()
    assert not mapped.captured[mapped.v_e > edge].any()
    assert not np.isfinite(mapped.thrown[mapped.captured]).any()
    assert found.capture_speed_m_per_s is not None
    # A throw comes down a little slower than it went up: alpha.
    assert edge == pytest.approx(found.capture_speed_m_per_s, rel=0.05)
    stairs = played_from(ROLL, 0.1)
    run = simulate(ROLL, 10.0, 0.1).contacts[:, 4]
    np.testing.assert_allclose(stairs, [0.1, *run[: len(stairs) - 1]], rtol=1e-12)
    figure = return_map(ROLL, mapped, found.cycles, stairs)
    drawn_lines = {line.get_label(): line.get_ydata() for line in figure.axes[0].lines}
    np.testing.assert_array_equal(drawn_lines["contact after contact"], mapped.rolling)
    np.testing.assert_array_equal(drawn_lines["the first contact after a throw"], mapped.thrown)


def test_predictions_are_those_of_the_analysis(tmp_path: Path):
    speeds = open_forecast(TWO_CYCLES, np.array([0.058, 0.06, 0.062]))
    assert list(filling(TWO_CYCLES, speeds)) == [1, 2, 3]
    found = analyse(TWO_CYCLES)
    assert speeds.eq7[1] == pytest.approx(found.v_lc_eq7_m_per_s, rel=1e-12)
    assert speeds.kappa[1] == pytest.approx(found.v_lc_kappa_m_per_s, rel=1e-12)
    assert speeds.unstable[1, 0] == pytest.approx(found.cycles[0].v_e_m_per_s, rel=1e-9)
    assert speeds.stable[1, 0] == pytest.approx(found.cycles[1].v_e_m_per_s, rel=1e-9)
    figure = predictions(TWO_CYCLES, speeds)
    assert drawn(figure, tmp_path) > 20
    by_label = {line.get_label(): line.get_ydata() for line in figure.axes[0].lines}
    np.testing.assert_array_equal(by_label["equation (7) as printed"], speeds.eq7)
    assert any(np.array_equal(line.get_ydata(), speeds.stable[:, 0]) for line in figure.axes[0].lines)
    rows = list(csv.DictReader(io.StringIO(tables.forecast(speeds))))
    assert [float(row["v_lc_unstable_1_m_per_s"]) for row in rows] == list(speeds.unstable[:, 0])
    assert [float(row["v_lc_eq7_m_per_s"]) for row in rows] == list(speeds.eq7)


def test_lines_join_only_cycles_that_belong_together():
    nan = math.nan
    speeds = np.array([[1.0, nan], [0.5, 1.05], [0.52, 1.1], [0.54, nan], [nan, nan], [9.0, nan]])
    first, second, third = branches(speeds)
    np.testing.assert_array_equal(first, [1.0, 1.05, 1.1, nan, nan, nan])
    np.testing.assert_array_equal(second, [nan, 0.5, 0.52, 0.54, nan, nan])
    np.testing.assert_array_equal(third, [nan, nan, nan, nan, nan, 9.0])


@EVERY
@pytest.mark.daily("roll")
def test_a_line_and_its_table(played: Scene, tmp_path: Path):
    done = last_of(
        played,
        [
            few(default_sweeps.line(played))
            if default_sweeps.line(played)
            else Axis("r_in", np.linspace(0.5, 40.0, 6))
        ],
    )
    figure = bifurcation(played, done)
    assert drawn(figure, tmp_path) > 20
    speeds = figure.axes[0].lines[0]
    np.testing.assert_array_equal(speeds.get_ydata(), done.v_e_m_per_s.ravel())
    np.testing.assert_array_equal(speeds.get_xdata(), np.repeat(done.axes[0].values, MEASURED))
    rows = list(csv.reader(io.StringIO(tables.swept(played, done))))
    assert rows[0][:4] == [
        f"{done.axes[0].name} ({'m/s' if played.effects else 'N s/m'})",
        "outcome",
        "rate_Hz",
        "period",
    ]
    assert len(rows) == 7
    for i, row in enumerate(rows[1:]):
        assert float(row[0]) == done.axes[0].values[i]
        assert row[1] == KINDS[done.kind[i]]
        assert int(row[3]) == done.period[i]
        written = [float(cell) if cell else math.nan for cell in [row[2], *row[4:]]]
        np.testing.assert_array_equal(written, [done.rate_Hz[i], *done.v_e_m_per_s[i]])


@EVERY
@pytest.mark.daily("roll")
def test_planes_and_their_tables(played: Scene, tmp_path: Path):
    for across, up in default_sweeps.planes(played):
        done = last_of(played, [few(across, 5), few(up, 4)])
        assert drawn(kinds(played, done), tmp_path) > 10
        assert drawn(rates(played, done), tmp_path) > 10
        rows = list(csv.DictReader(io.StringIO(tables.swept(played, done))))
        assert len(rows) == 20
        low = np.array([float(row["v_e_lowest_m_per_s"] or "nan") for row in rows]).reshape(5, 4)
        np.testing.assert_array_equal(low, done.v_e_m_per_s.min(axis=-1))
        assert [row["outcome"] for row in rows] == [KINDS[kind] for kind in done.kind.ravel()]


def test_the_heat_map_shows_the_rates_of_steady_rolls_and_nothing_else():
    done = last_of(
        ROLL, [Axis("k_hand", np.geomspace(5.0, 200.0, 6)), Axis("z_ss", np.linspace(-0.03, 0.0, 5))], 400
    )
    assert len(set(done.kind.ravel())) > 1
    heat = rates(ROLL, done).axes[0].collections
    shown = [
        mesh.get_array() for mesh in heat if mesh.get_array() is not None and mesh.get_array().size == 30
    ]
    expected = np.where(done.kind == STABLE, done.rate_Hz, np.nan).T
    np.testing.assert_array_equal(np.ma.filled(shown[-1].astype(float), np.nan).reshape(5, 6), expected)


@pytest.mark.long
def test_the_same_figure_is_the_same_file(tmp_path: Path):
    for name in ("a.png", "b.png", "a.svg", "b.svg"):
        save(phase_plane(ROLL, [], (0.1,)), tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


def test_words_beside_a_figure():
    assert effect_words(ROLL) == "pulse 0.2 m/s up at exit, τ = 2 ms"
    assert effect_words(ROLL, {"dv_pls"}) == "pulse up at exit, τ = 2 ms"
    assert effect_words(scene(STICK_A)) == "no pulse"
    assert axis_label(ROLL, "k_hand") == r"stiffness of the hand's hold  $K_\mathrm{hand}$  (N/m)"
    assert own_value(ROLL, "k_hand") == 20.0
    assert scale_of(np.geomspace(1.0, 9.0, 7)) == "log"
    assert scale_of(np.linspace(1.0, 9.0, 7)) == "linear"
    assert scale_of(np.linspace(-1.0, 9.0, 7)) == "linear"


def test_sweeps_as_asked_for():
    (line,) = sweep_option.axes(ROLL, ["dv_pls=0.05:2:100"])
    assert line.name == "dv_pls"
    np.testing.assert_allclose(line.values, np.linspace(0.05, 2.0, 100))
    across, up = sweep_option.axes(ROLL, ["k_hand=1:100:3:log", "z_h0=-0.02:0.01:4"])
    np.testing.assert_allclose(across.values, [1.0, 10.0, 100.0])
    assert (up.name, len(up.values)) == ("z_h0", 4)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["dv_pls"], "write NAME=LOW:HIGH:COUNT"),
        (["dv_pls=1:2"], "write NAME="),
        (["dv_pls=1:2:3:lin"], "write NAME="),
        (["dv_pls=a:2:3"], "'a' is not a number"),
        (["dv_pls=nan:2:3"], "not finite"),
        (["dv_pls=1:inf:3"], "not finite"),
        (["dv_pls=2:1:3"], "LOW 2 must be less than HIGH 1 m/s"),
        (["dv_pls=0:1:3:log"], "LOW must be above 0"),
        (["dv_pls=0:11:3"], "11 m/s is outside 0 .. 10 m/s"),
        (["dv_pls=0:1:1"], "COUNT '1'"),
        (["dv_pls=0:1:-5"], "COUNT '-5'"),
        (["dv_pls=0:1:2.5"], "COUNT '2.5'"),
        (["gamma=0:1:5"], "has no 'gamma'; it has m, k_coll"),
        (["dv_pls=0:1:5"] * 2, "two different parameters"),
        (["dv_pls=0:1:5"] * 3, "given 3 times"),
        (["z_h0=0:1:5", "z_ss=0:1:5"], "two views of one value"),
        (["dv_pls=0:1:1000", "k_hand=1:2:1000"], "1000000 points are too many"),
    ],
)
def test_sweeps_that_make_no_sense(given: list[str], said: str):
    with pytest.raises(CommandError) as stop:
        sweep_option.axes(ROLL, given)
    assert said in str(stop.value)
    assert stop.value.status == GIVEN


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    line, planes = default_sweeps.line, default_sweeps.planes

    def few_planes(played: Scene) -> list[tuple[Axis, ...]]:
        return [tuple(few(axis, 3) for axis in pair) for pair in planes(played)]

    monkeypatch.setattr(default_sweeps, "line", lambda played, points=5: line(played, 5))  # pyright: ignore
    monkeypatch.setattr(default_sweeps, "planes", few_planes)


@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize(
    ("name", "figures"),
    [
        ("roll", {"phase-plane", "effective-restitution", "return-map", "predictions", "bifurcation-dv_pls",
                  "rate-k_hand-z_h0", "outcome-k_hand-z_h0", "rate-dv_pls-k_hand", "outcome-dv_pls-k_hand"}),
        ("bare-drum", {"phase-plane", "effective-restitution", "return-map", "outcome-k_hand-z_h0"}),
    ],
)  # fmt: skip
@pytest.mark.daily("bare-drum*")
def test_everything_that_analyse_writes(
    name: str, figures: set[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    out = tmp_path / "not" / "yet there"
    analyse_command(name, True, out)
    said = capsys.readouterr()
    assert said.err == ""
    assert json.loads(said.out) == json.loads((out / "analysis.json").read_text(encoding="utf-8"))
    written = {path.name for path in out.iterdir()}
    assert {path.removesuffix(".png") for path in written if path.endswith(".png")} == figures
    assert {path.removesuffix(".svg") for path in written if path.endswith(".svg")} == figures
    assert {path for path in written if path.startswith("sweep-")} == {
        f"sweep-{figure.partition('-')[2]}.csv"
        for figure in figures
        if figure.startswith(("outcome", "bifurcation"))
    }


def test_the_sweep_that_was_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    analyse_command("roll", False, tmp_path, ["tau=0.001:0.004:3"])
    assert (
        f"written to {tmp_path}: analysis.json, sweep-tau.csv, bifurcation-tau.png" in capsys.readouterr().out
    )
    with (tmp_path / "sweep-tau.csv").open(encoding="utf-8") as lines:
        assert [float(row["tau (s)"]) for row in csv.DictReader(lines)] == [0.001, 0.0025, 0.004]


def test_what_is_wrong_is_said_before_the_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    with pytest.raises(CommandError, match="--out DIR"):
        analyse_command("roll", True, None, ["tau=0.001:0.004:3"])
    (tmp_path / "file").touch()
    for out in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(CommandError, match="a file is in the way") as stop:
            analyse_command("roll", True, out)
        assert stop.value.status == GIVEN

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "mkdir", refuse)
    with pytest.raises(CommandError, match="cannot be written: Permission denied") as stop:
        requirements.require_folder(tmp_path / "new")
    assert stop.value.status == LACKING


def test_without_matplotlib_one_line_says_what_to_type(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setattr("rig.extras.is_installed", lambda each: "matplotlib" not in each)
    with pytest.raises(CommandError, match=r"-m pip install 'matplotlib<4,>=3\.10'") as stop:
        analyse_command("roll", True, tmp_path)
    assert stop.value.status == LACKING
    assert not list(tmp_path.iterdir())
