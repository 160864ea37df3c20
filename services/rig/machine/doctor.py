"""`drumstick doctor`: what this machine has and lacks, each with what to do about it; the last fault, drawn.

It changes nothing, but for the picture of the last fault beside that fault's trace.
"""

import importlib
import json
import os
import platform
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from protocol.endpoint import host_and_port
from protocol.keys import DEFAULT_ROUTER
from protocol.osc import DEFAULT_IN
from rig import extras
from rig.exit_status import LACKING, CommandError
from rig.folder import ON_WINDOWS
from rig.machine.finding import Finding
from rig.network.ports import require_free_tcp, require_free_udp
from rig.options import PageOptions

if TYPE_CHECKING:
    from rig.last_fault import LastFault

_NEEDED = ("numpy", "numba", "zenoh", "msgspec")
_EXTRAS = {
    "sound": "sound card",
    "panel": "technician's page",
    "figures": "figures",
    "midi": "MIDI",
    "oscquery": "OSCQuery",
}


def _python() -> Finding:
    good = (3, 11) <= sys.version_info[:2] < (3, 15)
    return Finding("python", good, True, platform.python_version(), "use Python 3.11 to 3.14")


def _system() -> Finding:
    found = f"{platform.system()} {platform.release()}, {platform.machine()}"
    if sys.platform == "win32":
        return Finding("system", False, True, found, ON_WINDOWS)
    remedy = "it was tried on Linux only: no real-time priority here, no public listener (docs/install.md)"
    return Finding("system", sys.platform == "linux", False, found, remedy)


def _package(module: str, needed: bool, remedy: str) -> Finding:
    try:
        importlib.import_module(module)
    except (ImportError, OSError) as error:
        return Finding(module, False, needed, str(error).splitlines()[0], remedy)
    return Finding(module, True, needed, "there")


def _extra(name: str, use: str) -> Finding:
    line = extras.what_to_type(name)
    return Finding(use, not line, False, "not installed" if line else "there", f"type: {line}")


def _audio() -> Finding:
    remedy = "install libportaudio2 and plug in a sound card; until then the sound goes to a WAV file"
    try:
        sounddevice = importlib.import_module("sounddevice")
        devices = [d["name"] for d in sounddevice.query_devices() if d["max_output_channels"] > 0]
    except (ImportError, OSError) as error:
        return Finding("audio device", False, False, str(error), remedy)
    except Exception as error:  # noqa: BLE001  PortAudioError, whose class exists only if the import worked
        return Finding("audio device", False, False, str(error), remedy)
    found = (
        f"{', '.join(devices)}; in which blocks it plays well: drumstick audio-test" if devices else "none"
    )
    return Finding("audio device", bool(devices), False, found, remedy)


def _real_time() -> list[Finding]:
    if sys.platform != "linux":
        return []
    from rig.machine import real_time

    return [Finding(s.name, s.good, False, s.found, s.remedy) for s in real_time.examine()]


def _kernel_cache() -> Finding:
    from realtime.kernels.store import ROOT

    remedy = "make ~/.cache writable or set XDG_CACHE_HOME; until then every start compiles for half a minute"
    return Finding("kernel cache", ROOT is not None, False, str(ROOT or "not writable"), remedy)


def _port(name: str, check: Callable[[], None]) -> Finding:
    try:
        check()
    except CommandError as taken:
        return Finding(
            name,
            False,
            False,
            str(taken),
            "stop the program that has it (a running rig?), or use another port",
        )
    return Finding(name, True, False, "free")


def _ports() -> list[Finding]:
    router, page = host_and_port(DEFAULT_ROUTER), ("127.0.0.1", PageOptions.panel_port)
    return [
        _port(f"OSC port {DEFAULT_IN[1]}", lambda: require_free_udp(*DEFAULT_IN, "OSC port", "--osc-in")),
        _port(f"Zenoh port {router[1]}", lambda: require_free_tcp(*router, "Zenoh port", "--connect")),
        _port(f"panel port {page[1]}", lambda: require_free_tcp(*page, "panel port", "--panel-port")),
    ]


def _osc_targets() -> list[Finding]:
    if sys.platform == "win32":
        return []
    from rig.network import osc_targets

    rigs = osc_targets.playing()
    pairs = (
        f"rig {own.rig!r}: {words}"
        for at, own in enumerate(rigs)
        for words in osc_targets.collisions(own, rigs[at + 1 :])
    )
    found = "; ".join(pairs)
    return [
        Finding(
            "OSC targets",
            not found,
            False,
            found or "no two rigs of this XDG_RUNTIME_DIR send alike",
            osc_targets.REMEDY,
        )
    ]


def openhaptics() -> Finding:
    """Findings about a PHANTOM's driver, without loading it."""
    from haptic_server.servo.device.openhaptics.driver import diagnosis

    seen = diagnosis.of_machine if sys.platform == "linux" else diagnosis.of_environment
    troubles = seen(dict(os.environ))
    found = "; ".join(troubles) or "environment and ports are as the driver wants them"
    remedy = "only a real arm needs it: docs/phantom.md goes through it, calibration included"
    return Finding("openhaptics", not troubles, False, found, remedy)


@dataclass(frozen=True)
class Fault:
    """The last fault of a rig: in words, when (ISO 8601), the file of its ticks, their picture or why there is none."""

    fault: str
    at: str
    trace: str
    picture: str | None
    why_no_picture: str = ""


def _picture(last: "LastFault") -> tuple[str | None, str]:
    if line := extras.what_to_type("figures"):
        return None, f"to see its ticks drawn, type: {line}; then drumstick doctor again"
    from rig.figures.fault import fault
    from rig.figures.style import save
    from rig.last_fault import PICTURE

    path = last.path.with_name(PICTURE)
    try:
        save(fault(last), path)
    except OSError as error:
        return None, f"{path} cannot be written: {error.strerror}"
    return str(path), ""


def last_fault(rig: str) -> tuple[Finding, Fault | None]:
    """Find what the rig's force loop last stopped for on this machine; draws the picture.

    Raises CommandError for a bad name.
    """
    from rig import checks, folder
    from rig.last_fault import TraceError, read

    checks.rig_name(rig)
    place = folder.found_folder(rig)
    try:
        last = None if place is None else read(place)
    except TraceError as error:
        return Finding("last fault", False, False, str(error), "the next fault writes a new one"), None
    if last is None:
        return Finding("last fault", True, False, f"rig {rig!r} has none on record here"), None
    picture, why = _picture(last)
    fault_report = Fault(last.words, last.at.isoformat(timespec="seconds"), str(last.path), picture, why)
    found = f"{last.words} ({last.at:%Y-%m-%d %H:%M:%S}, rig {rig!r})"
    remedy = f"its last {len(last.t_s)} ticks: {picture or last.path}" + (f"; {why}" if why else "")
    return Finding("last fault", False, False, found, remedy), fault_report


def examine() -> list[Finding]:
    """Findings about this machine, in the order in which they are printed."""
    return [
        _system(),
        _python(),
        *(_package(m, True, "reinstall haptic-drumstick") for m in _NEEDED),
        *(_extra(name, use) for name, use in _EXTRAS.items()),
        openhaptics(),
        _audio(),
        *_real_time(),
        _kernel_cache(),
        *_ports(),
        *_osc_targets(),
    ]


def doctor(as_json: bool, rig: str | None = None, rig_file: Path | None = None) -> int:
    """Print the findings; the exit status: 3 when something needed is missing, else 0."""
    from rig.machine import access_seen

    trouble, fault = last_fault(access_seen.rig_of(rig_file, rig))
    findings = [*examine(), trouble, *(() if rig_file is None else access_seen.findings(rig_file, rig))]
    playable = all(f.good for f in findings if f.needed)
    if as_json:
        fault_report = None if fault is None else asdict(fault)
        print(
            json.dumps(
                {"playable": playable, "findings": [asdict(f) for f in findings], "last_fault": fault_report}
            )
        )
    else:
        for f in findings:
            mark = "good " if f.good else "LACKS" if f.needed else "could be better"
            print(
                f"{mark:15s} {f.name}: {f.found}"
                + ("" if f.good or not f.remedy else f"\n{'':15s}   -> {f.remedy}")
            )
        print("ready to play" if playable else "cannot play yet: see LACKS above")
    return 0 if playable else LACKING
