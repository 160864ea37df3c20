"""Verdicts of `drumstick doctor` on a kernel's files, on machines that are good, bad and odd."""

from pathlib import Path

import pytest

from rig.machine.real_time import Seen, examine, processors


def _machine(root: Path, **files: str) -> dict[str, Seen]:
    for name, text in files.items():
        path = root / name.replace("__", "/")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + "\n")
    return {seen.name: seen for seen in examine(root)}


_CPU = "sys__devices__system__cpu"
_BUILT = "proc__sys__kernel__version"


@pytest.mark.parametrize(
    ("files", "good", "found"),
    [
        ({"sys__kernel__realtime": "1"}, True, "PREEMPT_RT"),
        ({_BUILT: "#1 SMP PREEMPT_RT Debian"}, True, "PREEMPT_RT"),
        ({_BUILT: "#1 SMP PREEMPT_DYNAMIC Debian"}, True, "PREEMPT_DYNAMIC"),
        ({_BUILT: "#1 SMP PREEMPT_DYNAMIC Debian", "proc__cmdline": "preempt=none"}, False, "preempt=none"),
        ({"sys__kernel__debug__sched__preempt": "none (voluntary) full"}, False, "voluntary"),
        ({"sys__kernel__debug__sched__preempt": "none voluntary (full)"}, True, "full"),
        ({_BUILT: "#1 SMP Debian"}, False, "voluntary or none"),
        ({}, False, "voluntary or none"),
    ],
)
def test_preemption(tmp_path: Path, files: dict[str, str], good: bool, found: str) -> None:
    seen = _machine(tmp_path, **files)["kernel preemption"]
    assert (seen.good, found in seen.found) == (good, True), seen


def test_one_slow_processor_is_enough_to_be_told(tmp_path: Path) -> None:
    governor = "cpufreq__scaling_governor"
    seen = _machine(
        tmp_path, **{f"{_CPU}__cpu0__{governor}": "performance", f"{_CPU}__cpu1__{governor}": "powersave"}
    )["cpu governor"]
    assert not seen.good
    assert seen.found == "performance, powersave"


@pytest.mark.parametrize(
    ("runtime", "good", "found"), [("950000", True, "95%"), ("-1", False, "off"), ("100000", False, "10%")]
)
def test_throttling(tmp_path: Path, runtime: str, good: bool, found: str) -> None:
    files = {
        "proc__sys__kernel__sched_rt_runtime_us": runtime,
        "proc__sys__kernel__sched_rt_period_us": "1000000",
    }
    seen = _machine(tmp_path, **files)["real-time throttling"]
    assert seen.good == good
    assert found in seen.found


def test_interrupts_on_the_isolated_processor_are_named(tmp_path: Path) -> None:
    files = {f"{_CPU}__isolated": "2-3"}
    assert _machine(tmp_path, **files)["interrupts of the isolated processor"].good
    files |= {"proc__irq__24__effective_affinity_list": "3", "proc__irq__9__smp_affinity_list": "0-1"}
    seen = _machine(tmp_path, **files)["interrupts of the isolated processor"]
    assert (seen.good, seen.found) == (False, "interrupts 24 come on it")


def test_no_isolated_processor_is_no_fault(tmp_path: Path) -> None:
    seen = _machine(tmp_path)
    assert seen["isolated processor"].good
    assert "interrupts of the isolated processor" not in seen


@pytest.mark.parametrize(
    ("words", "numbers"),
    [("", set()), ("0,2-4", {0, 2, 3, 4}), ("(null)", set()), ("7", {7}), ("1-x", set())],
)
def test_lists_of_processors(words: str, numbers: set[int]) -> None:
    assert processors(words) == numbers
