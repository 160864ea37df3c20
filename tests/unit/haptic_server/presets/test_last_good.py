"""The last good set: written soon, by a thread of its own; a set that was followed by a fault is no good one."""

import errno
import os
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from haptic_server import records
from haptic_server.presets.last_good import PROBATION_NS, LastGood
from haptic_server.presets.preset import Preset
from haptic_server.presets.store import PresetStore
from osc_bench import BOUND_S

START = {"dv_pls": 0.2}


def _preset(values: Mapping[str, float]) -> Preset:
    return Preset("last", "roll", "now", dict(values), START)


def _until(good: Callable[[], bool]) -> None:
    end = time.monotonic() + BOUND_S
    while not good():
        assert time.monotonic() < end
        time.sleep(0.01)


def _kept(store: PresetStore) -> Mapping[str, float] | None:
    found = store.load_last()
    return None if found is None else found.preset.values


def test_what_is_noted_is_on_the_disk_soon(tmp_path: Path) -> None:
    store = PresetStore(tmp_path)
    keeper = LastGood(store, _preset, START)
    keeper.note({"dv_pls": 0.3}, 0)
    _until(lambda: _kept(store) == {"dv_pls": 0.3})
    keeper.note({"dv_pls": 0.4}, 1)
    _until(lambda: _kept(store) == {"dv_pls": 0.4})
    keeper.close()


def test_nothing_is_written_where_nothing_was_set(tmp_path: Path) -> None:
    store = PresetStore(tmp_path)
    LastGood(store, _preset, START).close()
    assert _kept(store) is None
    store.save_last(_preset({"dv_pls": 0.3}))
    LastGood(store, _preset, START).close()
    assert _kept(store) == {"dv_pls": 0.3}


def test_going_back_to_where_it_began_is_kept_too(tmp_path: Path) -> None:
    store = PresetStore(tmp_path)
    store.save_last(_preset({"dv_pls": 0.3}))  # of last time, restored or left out
    keeper = LastGood(store, _preset, START)
    keeper.note(START, 0)
    keeper.close()
    assert _kept(store) == START


def test_the_end_does_not_forget_the_newest(tmp_path: Path) -> None:
    store = PresetStore(tmp_path)
    keeper = LastGood(store, _preset, START)
    for i in range(100):
        keeper.note({"dv_pls": i / 100.0}, i)
    keeper.close()
    assert _kept(store) == {"dv_pls": 0.99}


def test_a_slider_that_is_dragged_does_not_wear_the_disk_out(tmp_path: Path) -> None:
    written: list[int] = []

    def counted(descriptor: int) -> None:
        written.append(descriptor)
        os.fsync(descriptor)

    keeper = LastGood(PresetStore(tmp_path, sync=counted), _preset, START)
    begun = time.monotonic()
    for i in range(60):
        keeper.note({"dv_pls": i / 100.0}, i)
        time.sleep(0.005)
    keeper.close()
    took_s = time.monotonic() - begun
    assert 2 <= len(written) <= 2 * (took_s / 0.2 + 3)  # two syncs a save, five saves a second


@pytest.mark.parametrize(
    ("kind", "after_ns", "kept"),
    [
        (records.TOO_FAST, PROBATION_NS - 1, 0.3),
        (records.SELF_DRIVEN, 0, 0.3),
        (records.TOO_FAST, PROBATION_NS, 0.4),  # it had proved itself
        (records.UNPLUGGED, 0, 0.4),  # a plug says nothing about the set
        (records.STALLED, 0, 0.4),
    ],
)
def test_a_set_before_a_fault(tmp_path: Path, kind: int, after_ns: int, kept: float) -> None:
    store = PresetStore(tmp_path)
    keeper = LastGood(store, _preset, START)
    keeper.note({"dv_pls": 0.3}, 0)
    keeper.note({"dv_pls": 0.4}, PROBATION_NS)
    keeper.fault(kind, PROBATION_NS + after_ns)
    keeper.close()
    assert _kept(store) == {"dv_pls": kept}


def test_a_disk_that_is_full_for_a_while(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    room = False

    def sync(descriptor: int) -> None:
        if not room:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        os.fsync(descriptor)

    store = PresetStore(tmp_path, sync=sync)
    keeper = LastGood(store, _preset, START)
    keeper.note({"dv_pls": 0.3}, 0)
    _until(lambda: "No space left" in caplog.text)
    assert _kept(store) is None
    room = True
    _until(lambda: _kept(store) == {"dv_pls": 0.3})  # without anything new to write
    keeper.close()
    assert caplog.text.count("No space left") == 1


def test_what_is_set_while_a_fault_lasts_is_kept(tmp_path: Path) -> None:
    store = PresetStore(tmp_path)
    keeper = LastGood(store, _preset, START)
    keeper.note({"dv_pls": 0.3}, 0)
    keeper.note({"dv_pls": 0.9}, PROBATION_NS)
    for state in range(300):  # it is told with every state
        now_ns = PROBATION_NS + state * PROBATION_NS // 100
        keeper.fault(records.TOO_FAST, now_ns)
        if state == 150:
            keeper.note({"dv_pls": 0.35}, now_ns)
    keeper.fault(records.NO_FAULT, 5 * PROBATION_NS)
    keeper.close()
    assert _kept(store) == {"dv_pls": 0.35}


def test_a_second_fault_of_the_same_kind_counts_again(tmp_path: Path) -> None:
    store = PresetStore(tmp_path)
    keeper = LastGood(store, _preset, START)
    keeper.note({"dv_pls": 0.3}, 0)
    for again, now_ns in enumerate((PROBATION_NS, 2 * PROBATION_NS)):
        keeper.note({"dv_pls": 0.9 + again / 100.0}, now_ns)
        keeper.fault(records.TOO_FAST, now_ns + 1)
        keeper.fault(records.NO_FAULT, now_ns + 2)
    keeper.close()
    assert _kept(store) == {"dv_pls": 0.3}
