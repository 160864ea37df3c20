"""Words of a start while kernels are compiled: counted in a store that is made here, by a clock that is told."""

import os
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from rig.scene_file import SceneFiles
from rig.supervision import start_progress, up
from rig.supervision.parts import HAPTIC, PANEL, SOUND
from rig.supervision.plan import Options
from rig.supervision.start_progress import StartProgress
from rig.supervision.up import Rig

PARTS = {HAPTIC, SOUND, PANEL}


@pytest.fixture(autouse=True)
def _needed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(start_progress, "_NEEDED", {HAPTIC: 6, SOUND: 4})


def _use(store: Path, module: str) -> Path:
    # As a service does when it imports the module. Time stamps are told too: a file system's may be coarse.
    folder = store / module
    folder.mkdir(parents=True, exist_ok=True)
    now_ns = folder.stat().st_mtime_ns + 10_000_000
    os.utime(folder, ns=(now_ns, now_ns))
    return folder


def _compile(store: Path, module: str, *kernels: str) -> None:
    for kernel in kernels:
        (store / module).mkdir(parents=True, exist_ok=True)
        (store / module / f"{kernel}.nbc").touch()
        (store / module / f"{kernel}.nbi").touch()
    _use(store, module)


def test_kernels_that_appear_are_counted_twice_a_second(tmp_path: Path) -> None:
    store = tmp_path / "kernels"
    progress = StartProgress(store, PARTS, 100.0)
    assert progress.words == ""
    _compile(store, "contact-1", "a", "b")
    progress.look(100.0)
    assert progress.words == "compiling 2 of about 10"
    _compile(store, "contact-1", "c")
    _compile(store, "mesh-1", "d")
    progress.look(100.49)
    assert progress.words == "compiling 2 of about 10"
    progress.look(100.5)
    assert progress.words == "compiling 4 of about 10"


def test_a_folder_that_did_not_change_is_not_read_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("contact-0", "contact-1", "mesh-1"):
        _compile(tmp_path, module, "a")
    progress = StartProgress(tmp_path, PARTS, 0.0)
    read: list[str] = []
    listdir: Callable[[str], list[str]] = os.listdir
    monkeypatch.setattr(os, "listdir", lambda path: (read.append(Path(path).name), listdir(path))[1])
    _compile(tmp_path, "mesh-1", "b")
    progress.look(0.5)
    progress.look(1.0)
    assert read == ["mesh-1"]


def test_a_start_that_compiles_nothing_says_nothing_of_it(tmp_path: Path) -> None:
    _compile(tmp_path, "contact-1", "a", "b")
    progress = StartProgress(tmp_path, PARTS, 0.0)
    _use(tmp_path, "contact-1")
    _use(tmp_path, "mesh-1")
    progress.look(0.5)
    assert progress.words == ""
    assert progress.report(9.9, "the sound", False) == ""
    assert progress.report(10.0, "the sound", False) == "still starting after 10 s: waiting for the sound"
    assert progress.report(19.9, "the sound", False) == ""
    assert progress.report(20.0, "the sound", True) == "still starting after 20 s: waiting for the sound"


def test_what_is_there_already_of_the_same_sources_is_not_to_be_compiled(tmp_path: Path) -> None:
    _compile(tmp_path, "contact-0", "of", "older", "sources")
    _compile(tmp_path, "contact-1", "a", "b")
    progress = StartProgress(tmp_path, PARTS, 0.0)
    _use(tmp_path, "contact-1")
    _compile(tmp_path, "mesh-1", "c")
    progress.look(0.5)
    assert progress.words == "compiling 1 of about 8"


def test_no_total_when_more_is_compiled_than_was_thought(tmp_path: Path) -> None:
    progress = StartProgress(tmp_path, {SOUND}, 0.0)
    _compile(tmp_path, "mesh-1", "a", "b", "c", "d")
    progress.look(0.5)
    assert progress.words == "compiling 4 of about 4"
    _compile(tmp_path, "mesh-1", "e")
    progress.look(1.0)
    assert progress.words == "5 compiled"


def test_a_folder_that_is_cleared_away_meanwhile_counts_for_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    progress = StartProgress(tmp_path, PARTS, 0.0)
    _compile(tmp_path, "contact-1", "a")
    _compile(tmp_path, "stale-1", "b")
    listdir: Callable[[str], list[str]] = os.listdir

    def gone(path: str) -> list[str]:
        if path.endswith("stale-1"):
            raise FileNotFoundError(path)
        return listdir(path)

    monkeypatch.setattr(os, "listdir", gone)
    progress.look(0.5)
    assert progress.words == "compiling 1 of about 10"


class _Service(SimpleNamespace):
    fault_status = None

    def __getattr__(self, _: str) -> Callable[..., None]:
        return lambda *_given, **_named: None


class _Clock:
    """Time that passes only while the rig sleeps; a kernel is compiled then. When all are, the rig plays."""

    def __init__(self, store: Path, kernels: int, step_s: float) -> None:
        self._now = 50.0
        self._store, self._left, self._step_s = store, kernels, step_s
        self.watch = _Service(state=None, meter=None, strikes=0, xruns=0)

    def monotonic(self) -> float:
        return self._now

    def sleep(self, _: float) -> None:
        self._now += self._step_s
        if self._left:
            self._left -= 1
            _compile(self._store, "contact-1", f"k{self._left}")
        elif self.watch.state is not None:
            self.watch.meter = SimpleNamespace(load=0.0, id="", sink="", played=0)
        else:
            self.watch.state = SimpleNamespace(
                status="playing", strikes=0, roll_rate_Hz=0.0, v_e_m_per_s=0.0,
                lateness_p99_us=0.0, lateness_worst_us=0.0,
            )  # fmt: skip


def _run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kernels: int, is_live: bool, sound_later: bool = False
) -> tuple[list[str], list[str]]:
    """Words of a rig's start, and of its status line."""
    clock = _Clock(tmp_path / "haptic-drumstick" / "kernels", kernels, 5.0)
    said: list[str] = []
    shown: list[str] = []
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(up, "time", clock)
    monkeypatch.setattr(up, "Service", lambda name, *_: _Service(name=name))
    monkeypatch.setattr(up, "on_stop_signals", lambda _: None)
    terminal = _Service(say=said.append, status=shown.append, is_live=is_live)
    parts = frozenset({HAPTIC, SOUND} if sound_later else {HAPTIC})
    options = Options("main", tmp_path, tmp_path, parts=parts)
    rig = Rig(options, SceneFiles("roll", ""), terminal)
    monkeypatch.setattr(rig, "_watch", clock.watch)
    rig.run(1.0)
    return said, shown


def test_on_a_terminal_one_line_is_rewritten(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said, shown = _run(tmp_path, monkeypatch, 3, True)
    assert said == []
    assert shown[:4] == [
        "starting ...",
        *(f"compiling {n} of about 6, waiting for the force loop" for n in (1, 2, 3)),
    ]
    assert shown[-1].startswith("playing |")
    assert "compil" not in shown[-1]


def test_the_line_is_short_while_the_force_loop_plays_and_the_sound_is_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, shown = _run(tmp_path, monkeypatch, 3, True, sound_later=True)
    assert "playing | 0 strikes | compiling 3 of about 10, waiting for the sound" in shown
    assert "compil" not in shown[-1]


def test_without_a_terminal_a_line_is_written_each_ten_seconds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said, _ = _run(tmp_path, monkeypatch, 7, False)
    assert [line.partition(", waiting")[0] for line in said] == [
        "compiling 2 of about 6 after 10 s",
        "compiling 4 of about 6 after 20 s",
        "compiling 6 of about 6 after 30 s",
    ]


def test_a_later_start_says_nothing_of_compiling(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said, shown = _run(tmp_path, monkeypatch, 0, False)
    assert said == []
    assert not [line for line in shown if "compil" in line]
