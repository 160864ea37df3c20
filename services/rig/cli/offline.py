"""The commands that need no rig: they compute, draw and render what a scene would do."""

from pathlib import Path
from typing import Annotated

import typer

from rig.cli.grouped import grouped
from rig.options import BesideSoundOptions, Figures, Json, SceneName, Sweeps
from sound_server.ranges import DEFAULT_RATE_HZ, RATES_HZ


def simulate_command(
    scene: SceneName,
    duration: Annotated[float, typer.Option(help="Simulated seconds.")] = 2.0,
    v0: Annotated[float, typer.Option("--v0", help="Upward speed at the start, m/s.")] = 0.4,
    method: Annotated[
        str,
        typer.Option(help="exact (no time step), semi_implicit_euler, verlet, rk4 or implicit_midpoint."),
    ] = "exact",
    dt: Annotated[
        float | None, typer.Option(help="With fixed steps: their length, s; 1e-5 if not given.")
    ] = None,
    events: Annotated[
        bool,
        typer.Option(
            help="With fixed steps: find the instant of each contact between two steps, or notice it a step late."
        ),
    ] = True,
    as_json: Json = False,
) -> None:
    """Compute a scene's contacts. The stick moves exactly, or in fixed time steps (--method), to compare the two."""
    from rig import checks
    from rig.offline.simulate import simulate

    checks.duration(duration)
    checks.finite(v0, "--v0", -100.0, 100.0, "m/s")
    simulate(scene, duration, v0, method, dt, events, as_json)


@grouped
def render_command(
    scene: SceneName,
    out: Annotated[Path, typer.Option(help="The WAV file to write.")],
    duration: Annotated[
        float | None, typer.Option(help="Seconds of sound; 3, or all of a recording, if not given.")
    ] = None,
    strikes: Annotated[
        Path | None,
        typer.Option(
            help="Strikes to play: CSV with t_s, x, y, speed_m_per_s, or a recording (.mcap). Without"
            " --strikes and --roll: one stroke at half radius."
        ),
    ] = None,
    roll: Annotated[bool, typer.Option("--roll", help="Play what the scene's own stick does.")] = False,
    rate: Annotated[int, typer.Option(help="Samples a second.")] = DEFAULT_RATE_HZ,
    *,
    beside: BesideSoundOptions,
    as_json: Json = False,
) -> None:
    """A scene's drum into a WAV file, offline."""
    from rig import checks
    from rig.offline.render import RenderOptions, render

    checks.duration(duration)
    checks.finite(rate, "--rate", *RATES_HZ, "Hz")
    seconds = 3.0 if duration is None else duration
    options = RenderOptions(out, seconds, strikes, roll, rate, beside.spectrogram, beside.modes, beside.stems)
    render(scene, options, as_json, whole=duration is None)


def analyse_command(
    scene: SceneName,
    rate: Annotated[
        float | None, typer.Option(help="Change k_hand, z_ss, dv_pls to a roll of this rate, Hz.")
    ] = None,
    level: Annotated[
        float | None, typer.Option(help="Change them to strikes of this level, above 0 and up to 1.")
    ] = None,
    out: Figures = None,
    sweep: Sweeps = None,
    as_json: Json = False,
) -> None:
    """Analyse a scene's roll.

    Its rate and speed, how fast it settles, whether it is stable; compared with the paper's equation (7).
    """
    from rig.offline.analyse import analyse

    analyse(scene, as_json, out, sweep or [], rate, level)


def scene_list(as_json: Json = False) -> None:
    """The shipped scenes."""
    from rig.offline import scene_commands

    scene_commands.show_list(as_json)


def scene_show(scene: SceneName, as_json: Json = False) -> None:
    """A scene's text; with --json every default is written out."""
    from rig.offline import scene_commands

    scene_commands.show(scene, as_json)


def scene_check(scene: SceneName) -> None:
    """Say everything that is wrong with a scene."""
    from rig.offline import scene_commands

    scene_commands.check(scene)


def scene_cost(scene: SceneName, as_json: Json = False) -> None:
    """Measure what a scene costs here. Each effect a tick, the mesh a sample, and the accuracy that it buys."""
    from rig.offline.scene_cost import cost

    cost(scene, as_json)
