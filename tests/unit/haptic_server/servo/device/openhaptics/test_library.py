"""Finding the library: by the environment, by the platform's names, once in a process; else in words."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from haptic_server.servo.device.openhaptics.driver import calls, diagnosis, library
from haptic_server.servo.device.protocol import DeviceError
from hd_stand_in import StandIn


@pytest.fixture(autouse=True)
def _fresh(monkeypatch: pytest.MonkeyPatch) -> None:
    """As a process that has loaded nothing yet, on a machine where nothing is set."""
    monkeypatch.setattr(library, "_loaded", [])
    for variable in (library.VARIABLE, "GTDD_HOME"):
        monkeypatch.delenv(variable, raising=False)


def refuses(message: str) -> Any:
    def loader(name: str) -> Any:
        raise OSError(message.format(name=name))

    return loader


@pytest.mark.parametrize(
    ("system", "first"),
    [("linux", "libHD.so"), ("win32", "HD.dll"), ("darwin", "libHD.dylib"), ("aix", "libHD.so")],
)
def test_each_platform_has_its_names(system: str, first: str) -> None:
    assert library.candidates(system, {})[0] == first


def test_a_path_from_the_environment_is_the_only_one_tried() -> None:
    assert library.candidates("linux", {library.VARIABLE: "/opt/x/libHD.so"}) == ("/opt/x/libHD.so",)


@pytest.mark.needs("cc")
def test_it_loads_what_the_environment_names(arm: StandIn, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(library.VARIABLE, str(arm.path))
    name, hd = library.load()
    assert name == str(arm.path)
    assert hd.init_device(None) == 7


@pytest.mark.needs("cc")
def test_a_second_load_in_one_process_is_refused(arm: StandIn, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(library.VARIABLE, str(arm.path))
    library.load()
    with pytest.raises(DeviceError, match="only once: start a new process"):
        library.load()


def test_nothing_there_is_one_error_that_names_every_attempt_and_what_to_do() -> None:
    with pytest.raises(DeviceError) as refusal:
        library.load(refuses("{name}: cannot open shared object file: No such file or directory"))
    text = str(refusal.value)
    for name in (
        "libHD.so:",
        "libHD.so.3.4:",
        library.VARIABLE,
        "GTDD_HOME is not set",
        "install OpenHaptics",
    ):
        assert name in text


@pytest.mark.parametrize(
    ("message", "cure"),
    [
        ("libPHANToMIO.so.4: cannot open shared object file", "comes with the device's driver"),
        ("libncurses.so.5: cannot open shared object file", "libncurses5"),
        ("libPhantomIOLib42.so: cannot open shared object file", "Touch driver"),
        ("libraw1394.so.8: cannot open shared object file", "libraw1394-11"),
        ("{name}: wrong ELF class: ELFCLASS32", "another processor or word size"),
        ("/lib/libm.so.6: version `GLIBC_2.99' not found", "older driver"),
    ],
)
def test_what_the_library_itself_lacks_is_named_with_its_cure(message: str, cure: str) -> None:
    with pytest.raises(DeviceError, match=cure) as refusal:
        library.load(refuses(message))
    assert "install OpenHaptics and" not in str(refusal.value)


def test_another_library_is_told_from_the_right_one() -> None:
    stranger = SimpleNamespace(
        **{name: SimpleNamespace() for name in calls.FUNCTIONS if name != "hdBeginFrame"}
    )
    with pytest.raises(DeviceError, match="lacks hdBeginFrame"):
        library.load(lambda _: stranger)
    with pytest.raises(
        DeviceError, match="lacks hdBeginFrame"
    ):  # a failure has loaded nothing: it may be tried again
        library.load(lambda _: stranger)


def test_the_drivers_home_must_be_a_folder(tmp_path: Path) -> None:
    assert diagnosis.of_environment({"GTDD_HOME": str(tmp_path)}) == []
    (missing,) = diagnosis.of_environment({"GTDD_HOME": str(tmp_path / "gone")})
    assert "is no folder" in missing


def test_a_port_that_may_not_be_used_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (absent,) = diagnosis.of_ports(tmp_path)
    assert "not plugged in" in absent
    (tmp_path / "ttyACM0").touch()
    assert diagnosis.of_ports(tmp_path) == []
    monkeypatch.setattr(diagnosis.os, "access", lambda *_: False)
    (barred,) = diagnosis.of_ports(tmp_path)
    assert "ttyACM0: you may not read and write it" in barred
    assert "dialout" in barred
