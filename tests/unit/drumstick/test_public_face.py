"""The public face: `import drumstick as ds` is light, its names are there, and every example on them runs."""

import dataclasses
import doctest
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import drumstick as ds
from drumstick import testing

_FLAGS = doctest.ELLIPSIS | doctest.IGNORE_EXCEPTION_DETAIL
PACKAGE = Path(str(ds.__file__)).parent


def in_a_process_of_its_own(program: str) -> list[str]:
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return done.stdout.split()


def test_import_brings_nothing_heavy() -> None:
    loaded = in_a_process_of_its_own("import sys, drumstick as ds; dir(ds); print(*sys.modules)")
    assert "drumstick" in loaded
    heavy = {"numba", "numpy", "scipy", "matplotlib", "haptic_server", "importlib.metadata"}
    assert not [name for name in loaded if name in heavy or name.startswith("drumstick.")]


def test_reading_a_scene_does_without_the_compiler() -> None:
    """numba comes when something is computed: half a second and 80 MB."""
    program = (
        "import sys, drumstick as ds; scenes = [ds.scene(name) for name in ds.scene_names()];"
        "[ds.values(each) for each in scenes]; ds.scene('snare', strainer=0.5);"
        "print(*({'numba', 'llvmlite', 'scipy'} & {*sys.modules}), sep=',');"
        "print(len(ds.simulate(scenes[0], 0.5).contacts) > 0, 'numba' in sys.modules)"
    )
    assert in_a_process_of_its_own(program) == ["True", "True"]


def test_a_picture_is_what_brings_matplotlib() -> None:
    program = (
        "import sys, drumstick as ds; run = ds.simulate(ds.scene('roll'), 0.5);"
        "print('matplotlib' in sys.modules, 'haptic_server' in sys.modules)"
    )
    assert in_a_process_of_its_own(program) == ["False", "False"]


@pytest.mark.parametrize("name", ds.__all__)
def test_each_name_is_there_and_documented(name: str) -> None:
    value = getattr(ds, name)
    assert name in dir(ds)
    if name != "__version__":
        assert ">>> " in str(value.__doc__), f"ds.{name} has no example"


@pytest.mark.parametrize(
    "asked",
    [
        lambda given: ds.simulate(given, 1.0),
        lambda given: ds.servo(given, 1.0),
        ds.render,
        ds.analyse,
        ds.values,
    ],
)
def test_a_name_in_place_of_a_scene_is_told_how_to_become_one(asked: Callable[[Any], object]) -> None:
    with pytest.raises(TypeError, match=r"'roll' is no scene: ds\.scene\('roll'\) reads one"):
        asked("roll")
    with pytest.raises(TypeError, match=r"7 is no scene$"):
        asked(7)


def test_no_room_of_the_package_bears_a_public_name() -> None:
    """Python would put the room in the name's place when it is imported."""
    assert not {path.stem for path in PACKAGE.iterdir()} & {*ds.__all__}


def test_what_is_not_public_is_no_attribute() -> None:
    with pytest.raises(AttributeError, match="module 'drumstick' has no attribute 'nothing'"):
        _ = ds.nothing


PUBLIC = {f"drumstick.{name}": getattr(ds, name) for name in ds.__all__ if name != "__version__"} | {
    f"drumstick.testing.{name}": getattr(testing, name) for name in testing.__all__
}
COMPILES = "drumstick.testing.check_effect"  # all of the motion, for an effect that the store has not


@pytest.mark.parametrize(
    "name",
    [
        "drumstick",
        "drumstick.testing",
        *sorted(PUBLIC.keys() - {COMPILES}),
        pytest.param(COMPILES, marks=pytest.mark.long),
    ],
)
def test_examples_run(name: str) -> None:
    finder = doctest.DocTestFinder(recurse=name in PUBLIC)
    of = PUBLIC[name] if name in PUBLIC else sys.modules[name]
    found = [case for case in finder.find(of, name, module=False) if case.examples]
    assert found, f"{name} has no example"
    for case in found:
        failed, _ = doctest.DocTestRunner(optionflags=_FLAGS).run(case)
        assert failed == 0, f"{case.name}: its example does something else; see the output"


@pytest.mark.parametrize("name", ds.scene_names())
def test_a_saved_scene_is_the_same_scene(name: str, tmp_path: Path) -> None:
    ds.save(ds.scene(name), tmp_path / "mine.toml")
    assert ds.scene(str(tmp_path / "mine.toml")) == ds.scene(name)


def test_values_are_set_by_wire_name_and_only_those() -> None:
    before, after = ds.scene("snare"), ds.scene("snare", k_hand=30.0, tau=0.003, strainer=0.5)
    changed = {name for name, value in ds.values(after).items() if value != ds.values(before)[name]}
    assert changed == {"k_hand", "tau", "strainer", "z_h0"}  # z_h0 is another view of z_ss, which stays
    assert ds.values(ds.scene("roll", z_h0=-0.01))["z_h0"] == pytest.approx(-0.01)


@pytest.mark.parametrize(
    ("source", "values", "said"),
    [
        ("rol", {}, r"no scene 'rol' \(did you mean 'roll'\?\); shipped: accents, "),
        ("missing.toml", {}, "missing.toml: cannot be read: No such file or directory"),
        ("[stick]\nm_kg = 3.0", {}, r"scene:2: stick.m_kg: 3.0 kg is outside 0.0001 .. 1 kg"),
        ("roll", {"dv_pls": 99.0}, r"dv_pls: 99 m/s is outside 0 .. 10 m/s"),
        ("roll", {"volume": 1.0}, "volume: no such parameter in this scene; it has m, k_coll, "),
        ("roll", {"z_ss": 0.0, "z_h0": 0.0}, "two views of one value"),
    ],
)
def test_mistakes_are_told_in_the_words_of_the_command_line(
    source: str, values: dict[str, float], said: str
) -> None:
    with pytest.raises(ds.SceneError, match=said):
        ds.scene(source, **values)


def test_old_names_are_read_with_a_warning() -> None:
    text = "[drum.effects.two_heads]\n"
    from drumstick.drum.effects.registry import FORMER_NAMES

    former = next(iter(FORMER_NAMES))
    with pytest.warns(FutureWarning, match=f"{former}: is called {FORMER_NAMES[former]} now"):
        ds.scene(text.replace("two_heads", former))


def test_motion_is_exact_in_any_order_and_shape() -> None:
    run = ds.simulate(ds.scene("roll"), 1.0)
    times = np.random.default_rng(1).uniform(0.0, 1.0, (3, 50))
    found, dense = run.motion(times), run.motion(np.sort(times, axis=None))
    assert found.z_m.shape == times.shape
    order = np.argsort(times, axis=None)
    np.testing.assert_array_equal(found.z_m.ravel()[order], dense.z_m)
    entries = run.motion(run.contacts["t_in_s"])
    np.testing.assert_allclose(entries.z_m, 0.0, atol=1e-12)
    np.testing.assert_allclose(
        run.motion(run.contacts["t_in_s"] - 1e-9).v_m_per_s, run.contacts["v_in_m_per_s"], atol=1e-6
    )
    assert run.motion(0.5).z_m.shape == ()
    for wrong in (-0.1, 1.1, float("nan")):
        with pytest.raises(ValueError, match=r"outside 0 .. 1 s"):
            run.motion(wrong)
    stepped = ds.simulate(ds.scene("roll"), 1.0, stepper=ds.Stepper("rk4", 1e-5))
    with pytest.raises(ValueError, match="by rk4 has no motion"):
        stepped.motion(0.5)


def test_a_sound_is_an_array_that_a_notebook_plays() -> None:
    sound = ds.render(ds.scene("roll"), [ds.strike(1.0), ds.strike(0.5, 0.2, 0.1, t_s=0.2)], 44_100)
    assert (sound.shape, sound.dtype, sound.rate_Hz) == ((97_020, 2), np.float32, 44_100)
    left = sound[:, 0]
    assert isinstance(left, ds.Sound)
    assert left.rate_Hz == 44_100
    assert left.wav()[:4] == b"RIFF"
    assert len(left.wav()) == 44 + 2 * len(left)
    heard = np.frombuffer(sound.wav(), "<i2", offset=44).reshape(-1, 2) / 32767.0
    np.testing.assert_allclose(heard, np.asarray(sound), atol=2e-5)
    assert sound._repr_html_().startswith('<audio controls src="data:audio/wav;base64,UklGR')
    with pytest.raises(ValueError, match=r"a rate of 8000 Hz is outside 22050 .. 192000 Hz"):
        ds.render(ds.scene("roll"), None, 8000)
    with pytest.raises(ValueError, match="a duration of 0 s"):
        ds.render(ds.scene("roll"), duration_s=0.0)


@pytest.mark.parametrize("duration_s", [0.0, -1.0, float("inf"), float("nan")])
def test_a_duration_that_is_none_is_refused(duration_s: float) -> None:
    for play in (ds.simulate, ds.servo):
        with pytest.raises(ValueError, match="give one above 0 s"):
            play(ds.scene("roll"), duration_s)


@pytest.mark.parametrize(
    ("key", "value"),
    [("k_coll_N_per_m", -5.0), ("k_coll_N_per_m", 1e9), ("r_out_N_s_per_m", -0.5), ("m_kg", float("nan"))],
)
def test_a_stick_that_no_scene_may_have_is_refused(key: str, value: float) -> None:
    roll = ds.scene("roll")
    built = dataclasses.replace(roll, stick=dataclasses.replace(roll.stick, **{key: value}))
    with pytest.raises(ValueError, match=rf"stick.{key}: {re.escape(f'{value:g}')} .* is outside"):
        ds.simulate(built, 0.1)
    with pytest.raises(ds.OutOfEnvelope):
        ds.servo(built, 0.1)


def test_a_servo_strikes_as_the_exact_stick_does() -> None:
    """The scene's stick is exact, so the tick that plays live must find the contacts of `simulate`."""
    scene = ds.scene("roll")
    run, played = ds.simulate(scene, 2.0), ds.servo(scene, 2.0)
    assert played.fault == ""
    np.testing.assert_allclose(
        played.strikes["t_s"], run.contacts["t_in_s"][: len(played.strikes)], atol=1e-8
    )
    assert abs(len(played.strikes) - len(run.contacts)) <= 1
    motion = run.motion(played.ticks["t_s"].clip(max=2.0))
    np.testing.assert_allclose(played.ticks["z_m"], motion.z_m, atol=1e-8)
    for ours, live in zip(run.drum_strikes(), played.drum_strikes(), strict=False):
        assert (live.x, live.y) == pytest.approx((ours.x, ours.y), abs=1e-3)
        assert live.impulse_N_s == pytest.approx(ours.impulse_N_s, rel=1e-3)


def test_a_gesture_is_found_or_asked_for() -> None:
    text = "[device]\nplant='phantom'\n[hand]\ngesture='recorded'\ngesture_file='mine.csv'\n"
    arm = ds.scene("phantom")
    from dataclasses import replace

    played = replace(
        arm,
        device=replace(arm.device, plant="phantom"),
        hand=replace(arm.hand, gesture="recorded", gesture_file="mine.csv"),
    )
    assert ds.scene(text).hand.gesture_file == "mine.csv"
    with pytest.raises(ds.SceneError, match=r"gesture_file: mine.csv is not a shipped one"):
        ds.servo(played, 0.1)
    with pytest.raises(ds.SceneError, match=r"mine.csv:3: z_m: 5 m is outside"):
        ds.servo(played, 0.1, gesture="t_s,z_m\n0,0.02\n1,5.0\n")
    assert len(ds.servo(played, 0.1, gesture="t_s,z_m\n0,0.02\n1,0.03\n2,0.02\n").ticks) == 100


def test_the_picture_of_an_analysis_is_its_return_map() -> None:
    pytest.importorskip("matplotlib").use("Agg")
    from matplotlib import pyplot

    found = ds.analyse(ds.scene("cor-literal"))
    axes = found.plot().axes[0]
    diagonal, curve, *rolls = axes.get_lines()
    speeds, after = np.asarray(curve.get_xdata()), np.asarray(curve.get_ydata())
    np.testing.assert_array_equal(np.asarray(diagonal.get_xdata()), np.asarray(diagonal.get_ydata()))
    assert len(rolls) == len(found.cycles) == 2
    for roll, cycle in zip(rolls, found.cycles, strict=True):
        at = float(np.asarray(roll.get_xdata())[0])
        assert at == cycle.v_e_m_per_s
        assert np.interp(at, speeds, after) == pytest.approx(at, rel=1e-3)
        assert (roll.get_markerfacecolor() == "black") == cycle.stable
    pyplot.close("all")
    with pytest.raises(ValueError, match="system_delay: the motion never repeats"):
        ds.analyse(ds.scene("delay-drum")).plot()
    assert (
        repr(found)
        == "Findings(cor-literal: unstable roll of 59.6 Hz; stable roll of 21.3 Hz; stable ends: 2)"
    )


def test_sounds_and_pictures_are_saved(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib").use("Agg")
    from matplotlib import pyplot

    sound = ds.render(ds.scene("roll"), duration_s=0.1)
    ds.save(sound, tmp_path / "one.wav")
    assert (tmp_path / "one.wav").read_bytes() == sound.wav()
    figure = sound.plot()
    ds.save(figure, str(tmp_path / "one.png"))
    ds.save(figure, tmp_path / "one.svg")
    pyplot.close(figure)
    assert (tmp_path / "one.png").read_bytes()[1:4] == b"PNG"
    assert b"<svg" in (tmp_path / "one.svg").read_bytes()
    with pytest.raises(OSError, match="No such file"):
        ds.save(sound, tmp_path / "nowhere" / "one.wav")


def test_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    scene = ds.scene("roll")
    run = ds.simulate(scene, 1.0)
    for shown in (run, ds.render(scene, run), ds.servo(scene, 0.5)):
        figure = shown.plot()
        assert figure.axes[-1].get_xlabel() == "time, s"
        pyplot.close(figure)
    monkeypatch.setattr(pyplot, "get_backend", lambda: "inline")
    run.plot()
    assert pyplot.get_fignums() == []  # else a notebook shows it twice
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ImportError, match="pip install 'haptic-drumstick"):
        run.plot()
