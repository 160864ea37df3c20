"""Fixtures of all tests: tools that may be missing, free ports, folders of its own, and the order of the suite."""

import gc
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Generator
from fnmatch import fnmatchcase
from pathlib import Path

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parents[1]
SYSTEM_TESTS = ROOT / "tests" / "system"
SLICES = 5
IN_CI = os.environ.get("CI", "").lower() == "true"

# The first example may compile kernels, so an example has no deadline; CI draws the same examples every time. Fifty of
# each test: millions are for `drumstick lab fuzz`.
settings.register_profile("ours", deadline=None, derandomize=IN_CI, print_blob=True, max_examples=50)
settings.load_profile("ours")

# What a worker collects and compiles stays: looking through all of it again and again takes a twentieth of the time.
gc.set_threshold(50_000, 20, 100)

# A test on the real clock may fail because the host of this virtual machine did not run it for so long. Nothing in the
# product can help that: such a test, and no other, is run once more, and the summary says so (RERUN).
_STALL_NS = 10_000_000


def pytest_configure(config: pytest.Config) -> None:
    """Alone with itself (alone.py), and to be stopped as anywhere.

    A suite in a shell's background ignores Ctrl-C, one under nohup a hangup, and so would all that it starts.
    """
    from alone import be_alone

    config.add_cleanup(be_alone(os.environ))
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if (
        signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    ):  # a handler is not inherited; the suite itself goes on
        signal.signal(signal.SIGHUP, lambda *_: None)


class HostStoodStill(Exception):
    """A test failed, and meanwhile threads of the highest priority saw a processor stand still."""


_STOOD_STILL = pytest.StashKey[bool]()


def _package_of(program: str) -> str:
    # deploy/system-packages.txt says after "have:" which programs a package brings.
    for line in (ROOT / "deploy" / "system-packages.txt").read_text(encoding="utf-8").splitlines():
        package, _, probe = line.partition("# have:")
        if program in re.findall(r"command -v (\S+)", probe):
            return package.strip()
    raise LookupError(f"deploy/system-packages.txt names no package that brings {program}")


def pytest_addoption(parser: pytest.Parser) -> None:
    """`--slice N`: of the files with tests marked long, every fifth."""
    parser.addoption("--slice", choices=("all", *map(str, range(SLICES))), default="all")


def _keep_slice(config: pytest.Config, items: list[pytest.Item]) -> None:
    # By file, so that what tests of one file share is started once; round and round, so that slices take much the same.
    chosen = str(config.getoption("slice"))
    if chosen == "all":
        return
    files = sorted({item.path for item in items if item.get_closest_marker("long") is not None})
    due = set(files[int(chosen) :: SLICES])
    config.hook.pytest_deselected(items=[item for item in items if item.path not in due])
    items[:] = [item for item in items if item.path in due]


def _leave_to_long(item: pytest.Item) -> None:
    # The case's name is what stands in brackets.
    name = item.name.partition("[")[2].removesuffix("]")
    for marker in item.iter_markers("daily"):
        if not any(fnmatchcase(name, pattern) for pattern in marker.args):
            item.add_marker(pytest.mark.long)


@pytest.hookimpl(tryfirst=True)  # before -m chooses
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark what lies in tests/system, and run it last: when a unit is broken, its own test should say so first."""
    for item in items:
        _leave_to_long(item)
    _keep_slice(config, items)
    for item in items:
        if item.path.is_relative_to(SYSTEM_TESTS) and item.get_closest_marker("system") is None:
            item.add_marker(pytest.mark.system)
        if _is_on_real_clock(item):
            item.add_marker(pytest.mark.flaky(reruns=1, only_rerun=[f"^{HostStoodStill.__name__}: "]))
    # On a real clock first: a process that has compiled for minutes was seen to hold its own threads up for too long.
    items.sort(
        key=lambda item: (
            item.get_closest_marker("system") is not None,
            item.get_closest_marker("real_clock") is None,
        )
    )


def _is_on_real_clock(item: pytest.Item) -> bool:
    return any(item.get_closest_marker(name) is not None for name in ("system", "real_clock"))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, None, None]:
    """A failure during a stall of the host becomes HostStoodStill."""
    if not _is_on_real_clock(item):
        return (yield)
    from haptic_server.servo.stall_detector import StallDetector

    item.stash[_STOOD_STILL] = False
    probes = StallDetector()
    try:
        with probes:
            return (yield)
    except Exception as failure:
        longest_ns = max((int(ended - begun) for begun, ended in probes.stalls()), default=0)
        if probes.refused or longest_ns < _STALL_NS:
            raise
        item.stash[_STOOD_STILL] = True
        raise HostStoodStill(f"{longest_ns / 1e6:.0f} ms during this test") from failure


@pytest.hookimpl(tryfirst=True)  # before the plugin for reruns, which keeps what the module shares
def pytest_runtest_teardown(item: pytest.Item) -> None:
    """After a stall of the host end what the module shares: it may have latched a fault. The rerun starts its own."""
    module = item.getparent(pytest.Module)
    if module is None or not item.stash.get(_STOOD_STILL, False):
        return
    try:
        # pytest has no public way to end the fixtures of a module early. Kept is what belongs to the folders around it.
        item.session._setupstate.teardown_exact(module.parent)
    except Exception as failure:
        raise HostStoodStill("and what the module shares did not end well") from failure


def pytest_runtest_setup(item: pytest.Item) -> None:
    """`@pytest.mark.needs("chromium")`: skip, and say what to install, where the program is missing."""
    for marker in item.iter_markers("needs"):
        missing = [str(program) for program in marker.args if shutil.which(str(program)) is None]
        if missing:
            packages = " ".join(sorted({_package_of(program) for program in missing}))
            pytest.skip(f"{', '.join(missing)} not found: sudo apt-get install {packages}")


def _fail_skip(report: pytest.TestReport | pytest.CollectReport) -> None:
    # An expected failure is also reported as skipped; that one stays.
    if IN_CI and report.outcome == "skipped" and not hasattr(report, "wasxfail"):
        reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
        report.outcome = "failed"
        report.longrepr = f"With CI=true nothing may be skipped. {reason}"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """With CI=true a skipped test is a failed test."""
    report = yield
    _fail_skip(report)
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """With CI=true a skipped file is a failed file."""
    report = yield
    _fail_skip(report)
    return report


@pytest.fixture
def free_port() -> Callable[[], int]:
    """Each call gives a port of 127.0.0.1 that is free for TCP and for UDP (ports.py)."""
    from ports import free_port

    return free_port


@pytest.fixture
def own_folders(tmp_path: Path) -> dict[str, str]:
    """An environment for child processes: HOME and the XDG folders are the test's own, all but the cache.

    The kernel cache stays shared with the rest of the session, or every child would compile for ten seconds.
    """
    cache = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    folders = {
        "HOME": "home",
        "XDG_CONFIG_HOME": "config",
        "XDG_STATE_HOME": "state",
        "XDG_DATA_HOME": "share",
    }
    environment = dict(os.environ, XDG_CACHE_HOME=cache)
    for variable, name in {**folders, "XDG_RUNTIME_DIR": "run"}.items():
        folder = tmp_path / name
        folder.mkdir(mode=0o700)
        environment[variable] = str(folder)
    environment["PATH"] = os.pathsep.join(
        [str(Path(sys.executable).parent), environment.get("PATH", os.defpath)]
    )
    return environment


@pytest.fixture(scope="session")
def own_package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder into which docs/template is installed, as a stranger's package is; for other processes' PYTHONPATH."""
    folder = tmp_path_factory.mktemp("installed")
    uv = Path(sys.executable).parent / "uv"
    install = [uv, "pip", "install", "--quiet", "--offline", "--no-deps", "--no-build-isolation"]
    where = ["--python", sys.executable, "--target", folder, ROOT / "docs" / "template"]
    subprocess.run([*install, *where], check=True)
    return folder
