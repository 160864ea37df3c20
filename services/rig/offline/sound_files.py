"""Files of a rendered sound: the mix, and where they are asked for its stems, one a pickup or microphone.

Stems are floats of 32 bit and not limited, so that their sum is the mix before its limiter.
"""

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from rig.exit_status import unavailable, usage_error

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from drumstick.parameters.scene import Scene
    from sound_server.sinks.wavfile import WavFile


def stem_files(folder: Path, scene: "Scene") -> dict[Path, int]:
    """Files of a scene's stems, and which pair of `parts` goes into each; rest.wav is what sounds beside the head."""
    from drumstick.drum.stems.separation import REST, has_rest, source_names

    names = {name: number for number, name in enumerate(source_names(scene), 1)}
    if has_rest(scene):
        names[REST] = 0
    return {folder / f"{name}.wav": number for name, number in names.items()}


def check_room(out: Path, stems: dict[Path, int], duration_s: float, rate_Hz: int) -> None:
    """Check, before the first byte, that the files fit: a disk that a sound has filled serves nobody.

    Raises CommandError.
    """
    from sound_server.sinks.wavfile import MAX_BYTES, bytes_of

    sizes = {out: bytes_of(duration_s, rate_Hz)}
    sizes |= dict.fromkeys(stems, bytes_of(duration_s, rate_Hz, is_float=True))
    for path, size in sizes.items():
        if size > MAX_BYTES:
            usage_error(
                f"{path}: {duration_s:g} s are {size / 1e9:.3g} GB; a WAV file holds {MAX_BYTES / 1e9:.3g} GB:"
                " give a shorter --duration or a lower --rate"
            )
    if out.exists() and not out.is_file():
        del sizes[out]  # a device such as /dev/null takes no room
    needed: dict[Path, float] = {}
    for path, size in sizes.items():
        needed[path.parent] = needed.get(path.parent, 0.0) + size - _size(path)
    for folder, size in needed.items():
        try:
            free = shutil.disk_usage(folder).free
        except OSError as error:
            unavailable(
                f"{next(p for p in sizes if p.parent == folder)}: cannot be written: {error.strerror}"
            )
        if size > free:
            unavailable(
                f"{folder}: {duration_s:g} s are {size / 1e9:.3g} GB, and the disk has room for {free / 1e9:.3g}"
                " GB: make room, or give a shorter --duration"
            )


def _size(path: Path) -> int:
    return path.stat().st_size if path.exists() else 0


def apart_from(out: Path, stems: dict[Path, int]) -> None:
    """Refuse a mix in the place of one of its stems. Raises CommandError."""
    if out.resolve() in {path.resolve() for path in stems}:
        usage_error(
            f"--out {out}: a stem is written to that file: give the mix another name or --stems another folder"
        )


def made_folder(folder: Path) -> None:
    """The folder for stems, made where it is missing. Raises CommandError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        unavailable(f"--stems {folder}: cannot be written: {error.strerror}")


class SoundFiles:
    """The mix's file, and those of `stems`. Raises CommandError when one cannot be written."""

    def __init__(self, out: Path, stems: dict[Path, int], rate_Hz: int, longest_s: float) -> None:
        self._open: dict[Path, WavFile] = {}
        self._stems = stems
        self._mix = self._opened(out, rate_Hz, longest_s)
        for path in stems:
            self._opened(path, rate_Hz, longest_s, is_float=True)

    def _opened(self, path: Path, rate_Hz: int, longest_s: float, is_float: bool = False) -> "WavFile":
        from sound_server.sinks.wavfile import WavFile

        try:
            found = self._open[path] = WavFile(path, rate_Hz, longest_s, is_float=is_float)
        except OSError as error:
            self.close()
            unavailable(f"{path}: cannot be written: {error.strerror}")
        return found

    def record(self, part: "npt.NDArray[np.float32]") -> "npt.NDArray[np.float32]":
        """Write a part as `drumstick.drum.render.parts` yields it; returns its mix."""
        from drumstick.drum.render import mixed

        mix = mixed(part) if self._stems else part
        self._mix.record(mix)
        for path, pair in self._stems.items():
            self._open[path].record(part[:, 2 * pair : 2 * pair + 2])
        for path, file in self._open.items():
            if not file.is_open:
                unavailable(f"{path}: the disk took no more")
        return mix

    def close(self) -> None:
        """Finish every file."""
        for file in self._open.values():
            file.close()
