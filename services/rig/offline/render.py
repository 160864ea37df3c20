"""`drumstick render`: a scene's drum into a WAV file, offline and as fast as the machine can."""

import csv
import json
import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from realtime.regular_file import read_lines
from rig import extras, scene_file
from rig.exit_status import unavailable, usage_error
from rig.offline.sound_files import SoundFiles, apart_from, check_room, made_folder, stem_files
from rig.recording.record import SUFFIX
from rig.supervision.preflight import playable

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from drumstick.drum.excitation.offline import StreamedContact
    from drumstick.drum.memory.strikes import OfflineStrike
    from drumstick.drum.render import LiveChange
    from drumstick.parameters.scene import Scene

_COLUMNS = {"t_s": (0.0, 86_400.0), "x": (-2.0, 2.0), "y": (-2.0, 2.0), "speed_m_per_s": (0.0, 100.0)}
_MAX_STRIKES = 1_000_000
_MAX_TABLE = 200_000_000  # bytes
_MAX_RECORDING_S = 3600.0  # that is rendered whole without being asked for: one bad time makes years
_MAX_PICTURE_S = 120.0


class RenderOptions(NamedTuple):
    """Request for a render; `strikes` is a CSV file or a recording, `roll`: what the scene's own stick plays."""

    out: Path
    duration_s: float
    strikes: Path | None
    roll: bool
    rate_Hz: int
    spectrogram: Path | None = None  # pictures, PNG or SVG
    modes: Path | None = None
    stems: Path | None = None  # folder


class Written(NamedTuple):
    """Result of a rendering: its largest sample, its speed in times real time, and the sound if it is to be drawn."""

    peak: float
    times_real_time: float
    sound: "npt.NDArray[np.float32]"


def _number(row: dict[str, str | None], name: str, place: str) -> float:
    low, high = _COLUMNS[name]
    text = row[name]
    try:
        value = float(text or "")
    except ValueError:
        usage_error(f"{place}: {name}: {text and text[:60]!r} is not a number")
    if not (math.isfinite(value) and low <= value <= high):
        usage_error(f"{place}: {name}: {value:g} is outside {low:g} .. {high:g}")
    return value


def strikes_of(path: Path, scene: "Scene") -> list["OfflineStrike"]:
    """The strikes of a CSV table, for this scene's drum. Raises CommandError."""
    from drumstick.drum.calibrate import strike_for_speed

    blows: list[OfflineStrike] = []
    try:
        table = csv.DictReader(read_lines(path, _MAX_TABLE))
        missing = [name for name in _COLUMNS if name not in (table.fieldnames or [])]
        if missing:
            usage_error(f"{path}: not a table of strikes: it needs the columns {', '.join(_COLUMNS)}")
        before_s = 0.0
        for row in table:
            place = f"{path}:{table.line_num}"
            t_s, x, y, speed = (_number(row, name, place) for name in _COLUMNS)
            if t_s < before_s:
                usage_error(f"{place}: t_s goes back: {t_s:.15g} s after {before_s:.15g} s")
            before_s = t_s
            blows.append(strike_for_speed(scene, speed, x, y, t_s))
            if len(blows) > _MAX_STRIKES:
                usage_error(f"{path}: more than {_MAX_STRIKES} strikes; cut it")
    except OSError as error:
        usage_error(f"{path}: cannot be read: {error.strerror}")
    except (UnicodeDecodeError, csv.Error) as error:
        usage_error(f"{path}: not a table of strikes (CSV): {error}")
    return blows


def _strikes(name: str, scene: "Scene", options: RenderOptions) -> list["OfflineStrike"]:
    from drumstick.public.run import simulate
    from drumstick.public.sound import strikes_of as blows_of

    if options.strikes is not None:
        return strikes_of(options.strikes, scene)
    if not options.roll:
        return blows_of(scene, None)
    return blows_of(scene, simulate(scene, options.duration_s, gesture=scene_file.gesture(name, scene)))


class RenderInput(NamedTuple):
    """Strikes by their messages, contacts by their forces, how long they last, where that is known, what is set in the
    drum meanwhile, and when it is choked, s.
    """

    blows: "list[OfflineStrike]"
    presses: "list[StreamedContact]"
    length_s: float | None = None
    changes: "Sequence[LiveChange]" = ()
    chokes: "Sequence[float]" = ()


def _score(name: str, scene: "Scene", options: RenderOptions) -> RenderInput:
    if options.strikes is not None and options.roll:
        usage_error("--strikes and --roll: give one of the two")
    if options.strikes is not None and options.strikes.suffix == SUFFIX:
        from rig.offline.recorded_strikes import played

        return RenderInput(*played(options.strikes, scene))
    if options.roll and scene.drum.excitation == "streamed":  # by its forces, not by its strikes
        from rig.offline.streamed_roll import presses

        return RenderInput([], list(presses(scene, options.duration_s, scene_file.gesture(name, scene))))
    return RenderInput(_strikes(name, scene, options), [])


def _write(scene: "Scene", score: RenderInput, options: RenderOptions, stems: dict[Path, int]) -> Written:
    import numpy as np
    from rich.console import Console
    from rich.progress import Progress

    from drumstick.drum.render import parts

    files = SoundFiles(options.out, stems, options.rate_Hz, options.duration_s + 1.0)
    top, kept = 0.0, [np.zeros((0, 2), np.float32)]
    # The first part waits for what must be built, and perhaps compiled; the speed is that of the others.
    frames, first, begun = 0, 0, time.monotonic()
    try:
        with Progress(console=Console(stderr=True), transient=True) as progress:
            task = progress.add_task("rendering", total=options.duration_s)
            played = score.presses, score.changes, score.chokes
            for part in parts(
                scene, score.blows, options.duration_s, options.rate_Hz, *played, stems=bool(stems)
            ):
                mix = files.record(part)
                top = max(top, float(np.abs(mix).max()))
                if options.spectrogram is not None:
                    kept.append(mix.copy())
                progress.advance(task, len(part) / options.rate_Hz)
                frames += len(part)
                if frames == len(part) and frames < round(options.duration_s * options.rate_Hz):
                    first, begun = frames, time.monotonic()
    finally:
        files.close()
    times = (frames - first) / options.rate_Hz / (time.monotonic() - begun)
    return Written(top, times, np.concatenate(kept))


def _whole(options: RenderOptions, length_s: float) -> RenderOptions:
    # All of a recording, unless nobody can have meant it.
    if length_s > _MAX_RECORDING_S:
        from sound_server.sinks.wavfile import bytes_of

        usage_error(
            f"{options.strikes}: from its first strike to its last it lasts {length_s:.4g} s, "
            f"{bytes_of(length_s, options.rate_Hz) / 1e9:.3g} GB of sound: is a time in it wrong? More than "
            f"{_MAX_RECORDING_S:g} s are rendered only when asked for: --duration SECONDS, from its beginning"
        )
    return options._replace(duration_s=length_s)


def _check_pictures(options: RenderOptions) -> None:
    for option, path in (("--spectrogram", options.spectrogram), ("--modes", options.modes)):
        if path is None:
            continue
        if path.suffix not in (".png", ".svg"):
            usage_error(f"{option} {path}: give a file that ends in .png or .svg")
        extras.require(option, "figures")
    if options.spectrogram is not None and options.duration_s > _MAX_PICTURE_S:
        usage_error(
            f"--spectrogram: {options.duration_s:g} s are more than the {_MAX_PICTURE_S:g} s that it draws"
        )


def _draw(
    scene: "Scene", sound: "npt.NDArray[np.float32]", options: RenderOptions
) -> list[dict[str, object]]:
    # The pictures that were asked for; returns the table of modes.
    if options.spectrogram is None and options.modes is None:
        return []
    from rig.figures.style import save

    rows: list[dict[str, object]] = []
    try:
        if options.spectrogram is not None:
            from rig.figures.sounds.spectrogram import spectrogram

            save(spectrogram(sound, options.rate_Hz, scene.drum.f01_Hz, scene.name), options.spectrogram)
        if options.modes is not None:
            from drumstick.drum.measurement.measured_modes import measured_modes
            from rig.figures.sounds.modes import modes

            heard = measured_modes(scene, options.rate_Hz)
            save(modes(heard, f"{scene.name}: modes of one soft strike"), options.modes)
            rows = [mode._asdict() for mode in heard.modes]
    except OSError as error:
        unavailable(f"{error.filename}: cannot be written: {error.strerror}")
    return rows


def _decibels(peak: float) -> str:
    return f"{20.0 * math.log10(peak):.1f} dBFS" if peak > 0.0 else "silent"


def render(scene: str, options: RenderOptions, as_json: bool, whole: bool = False) -> None:
    """Write the file and say what is in it; `whole`: a recording from end to end. Raises CommandError."""
    loaded = scene_file.load(scene)
    stems = {} if options.stems is None else stem_files(options.stems, loaded)
    if options.stems is not None:
        apart_from(options.out, stems)
        made_folder(options.stems)
    check_room(options.out, stems, options.duration_s, options.rate_Hz)
    score = _score(scene, loaded, options)
    if whole and score.length_s is not None:
        options = _whole(options, score.length_s)
        check_room(options.out, stems, options.duration_s, options.rate_Hz)
    _check_pictures(options)
    score = score._replace(
        blows=[blow for blow in score.blows if blow.t_s < options.duration_s],
        presses=[press for press in score.presses if press.first_tick < options.duration_s * press.rate_Hz],
    )
    with playable():
        written = _write(loaded, score, options, stems)
    strikes = len(score.blows) + sum(press.begins for press in score.presses)
    modes = _draw(loaded, written.sound, options)
    if as_json:
        found: dict[str, object] = {
            "scene": loaded.name,
            "file": str(options.out),
            "duration_s": options.duration_s,
            "rate_Hz": options.rate_Hz,
            "strikes": strikes,
            "peak": written.peak,
            "times_real_time": written.times_real_time,
        }
        if options.modes is not None:
            found["modes"] = modes
        if stems:
            found["stems"] = [str(path) for path in stems]
        print(json.dumps(found))
        return
    print(
        f"{options.out}: {options.duration_s:g} s of {loaded.name}, {strikes} strike{'' if strikes == 1 else 's'}, "
        f"peak {_decibels(written.peak)}, rendered at {written.times_real_time:.0f}x real time"
    )
    if stems:
        print(f"{options.stems}: {', '.join(path.name for path in stems)}")
