"""The doctor's rows about a rig's last fault, about figures and about a PHANTOM; the picture of the fault's ticks."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread

import sampled_arm
from haptic_server import files
from haptic_server.records import FAULT_WORDS, NO_FAULT, NOT_A_NUMBER, STALLED, TOO_FAST
from haptic_server.servo import loop, trace
from haptic_server.servo.device.openhaptics.driver import diagnosis
from haptic_server.servo.force.memory import Servo
from rig import folder
from rig.exit_status import GIVEN, CommandError
from rig.figures.fault import fault
from rig.last_fault import PICTURE, LastFault, TraceError, read
from rig.machine import doctor

SECOND = 1000


def _not_a_number(servo: Servo, now_ns: int) -> None:
    # An arm that stands nowhere.
    servo.plant["z_m"] = math.nan
    loop.run_virtual(servo, 1, now_ns)


def _thrown(servo: Servo, now_ns: int) -> None:
    servo.plant["v_m_per_s"] = -1.9
    loop.run_virtual(servo, 5, now_ns)


def _stalled(servo: Servo, now_ns: int) -> None:
    loop.traced_tick(servo, now_ns + 41_000_000, 0.041)


FAULTS = {NOT_A_NUMBER: _not_a_number, TOO_FAST: _thrown, STALLED: _stalled}


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The run folder of a rig "here", empty."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return folder.run_folder("here")


def faulted(place: Path, code: int, ticks: int = 2 * SECOND) -> Servo:
    """A servo that faulted after so many ticks, its trace written as the force loop's process does."""
    servo = sampled_arm.servo_of(sampled_arm.scene("strokes"))
    FAULTS[code](servo, loop.run_virtual(servo, ticks, 0))
    assert servo.tick_state[0]["fault"] == code
    rows = trace.ordered(servo.trace, int(servo.tick_state[0]["traced"]))
    (place / files.TRACE).write_text(trace.as_csv(rows), encoding="utf-8")
    return servo


def last_of(place: Path) -> LastFault:
    found = read(place)
    assert found is not None
    return found


def test_what_is_read_is_what_the_force_loop_kept(place: Path) -> None:
    servo = faulted(place, STALLED)
    last, kept = last_of(place), trace.ordered(servo.trace, int(servo.tick_state[0]["traced"]))
    assert (last.code, last.words, len(last.t_s)) == (STALLED, FAULT_WORDS[STALLED], 1000)
    np.testing.assert_array_equal(last.z_m, kept["z_m"])
    np.testing.assert_array_equal(last.force_N, kept["force_N"])
    np.testing.assert_allclose(last.t_s, (kept["t_ns"] - kept["t_ns"][-1]) * 1e-9, atol=1e-9)
    assert last.span_s[-1] == 0.041
    assert last.force_N[-1] == 0.0
    assert last.force_N.max() > 0.5


def test_the_reading_that_raised_the_fault_is_in_the_record(place: Path) -> None:
    faulted(place, TOO_FAST)
    last = last_of(place)
    speeds = np.diff(last.told_z_m) / 1e-3
    assert abs(speeds[-1]) > 1.5, "told, and refused"
    assert np.abs(last.v_m_per_s).max() <= 1.5
    faulted(place, NOT_A_NUMBER)
    assert not abs(last_of(place).told_z_m[-1]) < 1e3
    assert np.isfinite(last_of(place).z_m).all()


@pytest.mark.parametrize(
    ("code", "ticks"), [(STALLED, 2000), (TOO_FAST, 2000), (NOT_A_NUMBER, 2000), (STALLED, 0)]
)
@pytest.mark.daily("4-2000")
def test_every_fault_can_be_drawn(place: Path, code: int, ticks: int) -> None:
    faulted(place, code, ticks)
    last = last_of(place)
    figure: Figure = fault(last)
    whole = figure.axes[::2]
    for axes, values in zip(
        whole, (last.z_m * 1e3, last.v_m_per_s, last.force_N, last.span_s * 1e3), strict=True
    ):
        np.testing.assert_array_equal(axes.lines[0].get_ydata(), values)
        np.testing.assert_array_equal(axes.lines[0].get_xdata(), last.t_s * 1e3)
        low, high = axes.get_ylim()
        assert low <= np.nanmin(values) <= np.nanmax(values) <= high
    row, told = doctor.last_fault("here")
    assert told is not None
    assert told.picture == str(place / PICTURE)
    assert told.picture in row.remedy
    pixels = imread(place / PICTURE)
    assert pixels.shape[0] > 800
    assert len(np.unique((pixels * 255).astype(np.uint8).view(np.uint32))) > 20


def test_the_doctor_tells_it_in_words_and_as_json(
    place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    faulted(place, STALLED)
    monkeypatch.setattr(doctor, "examine", list)
    assert doctor.doctor(as_json=True, rig="here") == 0
    told = json.loads(capsys.readouterr().out)
    assert told["last_fault"]["fault"] == FAULT_WORDS[STALLED]
    assert told["last_fault"]["picture"] == str(place / PICTURE)
    assert [row["name"] for row in told["findings"]] == ["last fault"]
    assert doctor.doctor(as_json=False, rig="here") == 0
    said = capsys.readouterr().out
    assert FAULT_WORDS[STALLED] in said
    assert str(place / PICTURE) in said


def test_no_fault_on_record_and_nothing_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    row, told = doctor.last_fault("nobody")
    assert (row.good, told) == (True, None)
    assert "'nobody' has none on record here" in row.found
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(CommandError) as stop:
        doctor.last_fault("a/b")
    assert stop.value.status == GIVEN


def test_without_matplotlib_it_says_what_to_type(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    faulted(place, STALLED)
    monkeypatch.setattr("rig.extras.is_installed", lambda each: "matplotlib" not in each)
    row, told = doctor.last_fault("here")
    assert told is not None
    assert told.picture is None
    assert str(place / files.TRACE) in row.remedy
    assert "-m pip install 'matplotlib" in row.remedy
    assert not (place / PICTURE).exists()
    (figures,) = (row for row in doctor.examine() if row.name == "figures")
    assert not figures.good
    assert not figures.needed
    assert "-m pip install 'matplotlib" in figures.remedy


def test_a_picture_that_cannot_be_written_is_no_fault_of_the_doctors(place: Path) -> None:
    faulted(place, STALLED)
    (place / PICTURE).mkdir()
    row, told = doctor.last_fault("here")
    assert told is not None
    assert told.picture is None
    assert f"{place / PICTURE} cannot be written: Is a directory" in row.remedy


GOOD = f"t_ns,span_s,z_m,v_m_per_s,force_N,place,fault,told_z_m,fresh\n1,0.001,0,0,0,0,{STALLED},0,1\n"
BROKEN = {
    "not the columns": ("a,b\n1,2\n", "has no column t_ns, span_s"),
    "no ticks": (GOOD.splitlines(keepends=True)[0], "has no ticks in it"),
    "cut off in a number's place": (GOOD + "2,0.001,0", r"trace\.csv:3: v_m_per_s: None is not a number"),
    "words": (GOOD.replace("0.001", "soon"), r"trace\.csv:2: span_s: 'soon' is not a number"),
    "no fault at its end": (GOOD.replace(f",{STALLED},", f",{NO_FAULT},"), "does not end with a fault"),
    "a time that is none": (GOOD.replace("1,0.001", "nan,0.001"), "does not end with a fault"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_trace_that_is_broken_is_told_and_not_drawn(place: Path, name: str) -> None:
    text, said = BROKEN[name]
    (place / files.TRACE).write_text(text, encoding="utf-8")
    with pytest.raises(TraceError, match=said):
        read(place)
    row, told = doctor.last_fault("here")
    assert told is None
    assert not row.good
    assert not row.needed


def test_bytes_that_are_no_text(place: Path) -> None:
    (place / files.TRACE).write_bytes(GOOD.encode().replace(b"0.001", b"\xff\x00"))
    with pytest.raises(TraceError, match="not the force loop's CSV"):
        read(place)


def test_the_row_about_a_phantom(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("GTDD_HOME", raising=False)
    row = doctor.openhaptics()
    assert (row.good, row.needed) == (False, False)
    assert "GTDD_HOME is not set" in row.found
    assert "docs/phantom.md" in row.remedy
    monkeypatch.setenv("GTDD_HOME", str(tmp_path))
    (tmp_path / "ttyACM0").touch()
    of_machine = diagnosis.of_machine
    monkeypatch.setattr(diagnosis, "of_machine", lambda environment: of_machine(environment, tmp_path))  # pyright: ignore
    monkeypatch.setattr(doctor.sys, "platform", "linux")
    assert doctor.openhaptics().good
