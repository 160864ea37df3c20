"""Trials of mutants: each in a copy of the tree, by the tests of its module, until one fails.

The copies are of the commit at HEAD, never of what somebody is typing. Every worker has its own, with its own kernel
cache: a mutant starts with the kernels of the unchanged tree, and what it compiles goes with it.
"""

import ast
import contextlib
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from drumstick_lab.checkout import ROOT

PACKAGES = ("shared", "services")
KILLED, TIMED_OUT, SURVIVED, NOT_COMPILED = "killed", "timed out", "survived", "not compiled"
_LIMIT_S = 1200.0  # for all tests of a mutant
_ONE_TEST_S, _FIRST_TIME_S = 120, 600  # the first time, with every kernel to compile
_FIRST_FAILURE = re.compile(r"^(?:FAILED|ERROR) (\S+)", re.MULTILINE)
# A test's function in pytest's summary, without the values that it was called with.
_OUTCOME = re.compile(r"^(PASSED|FAILED|ERROR) (tests/[^\s\[]+::[^\s\[]+)", re.MULTILINE)


@dataclass(frozen=True)
class Verdict:
    """A mutant's fate, the test that decided it, its time, and the commit it was tried on."""

    fate: str
    by: str
    seconds: float
    commit: str = ""


def commit() -> str:
    return _git("rev-parse", "HEAD")


def uncommitted() -> list[str]:
    return _git("diff", "--name-only", "HEAD", "--", *PACKAGES, "tests").splitlines()


def _git(*words: str) -> str:
    found = subprocess.run(("git", *words), cwd=ROOT, capture_output=True, text=True, check=True)
    return found.stdout.strip()


class Imports:
    """Imports among our packages, by reading them: `import` anywhere in a file counts."""

    def __init__(self, tree: Path) -> None:
        self._files = {
            _name(path.relative_to(tree / part)): path
            for part in PACKAGES
            for path in sorted((tree / part).rglob("*.py"))
        }
        self._direct = {name: self._named_in(path) for name, path in self._files.items()}

    def _named_in(self, path: Path) -> set[str]:
        named: set[str] = set()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                named.update(each.name for each in node.names)
            elif isinstance(node, ast.ImportFrom) and node.module:
                named.update({node.module, *(f"{node.module}.{each.name}" for each in node.names)})
        return named & self._files.keys()

    def below(self, path: str) -> str:
        """A hash of every module that this one reaches, itself left out."""
        found = {_name_of(path)}
        while more := {each for name in found for each in self._direct[name]} - found:
            found |= more
        digest = hashlib.sha256()
        for name in sorted(found - {_name_of(path)}):
            digest.update(name.encode() + self._files[name].read_bytes())
        return digest.hexdigest()


def _name_of(path: str) -> str:
    return _name(Path(path).relative_to(Path(path).parts[0]))


def _name(path: Path) -> str:
    parts = path.with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


class Copy:
    """One copy of the tree with its kernels, for one worker."""

    def __init__(self, folder: Path) -> None:
        self.tree = folder / "tree"
        self._said = folder / "said.txt"
        self._kernels = folder / "kernels"
        self._own = folder / "mutant"
        self._aside = folder / "aside"
        self._running: subprocess.Popen[str] | None = None

    def stop(self) -> None:
        """End the tests that run now. Another thread than theirs."""
        if self._running is not None:
            _end(self._running)

    @classmethod
    def fresh(cls, folder: Path, head: str) -> "Copy":
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        copy = cls(folder)
        subprocess.run(("git", "clone", "--quiet", str(ROOT), str(copy.tree)), check=True)
        subprocess.run(("git", "checkout", "--quiet", "--detach", head), cwd=copy.tree, check=True)
        return copy

    def twin(self, folder: Path) -> "Copy":
        """Another one for another worker."""
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(self.tree.parent, folder, symlinks=True)
        return Copy(folder)

    def passes(self, tests: Sequence[str]) -> Verdict:
        """The tests of the unchanged tree, which also compiles its kernels."""
        return self._run(tests, self._kernels, _FIRST_TIME_S, "-x")

    def judge(self, path: str, source: str, tests: Sequence[str], *options: str) -> Verdict:
        target, aside = self.tree / path, self._aside / path
        aside.parent.mkdir(parents=True)
        shutil.copy2(target, aside)
        try:
            target.write_text(source, encoding="utf-8")
            shutil.copytree(self._kernels, self._own, copy_function=os.link)
            return self._run(tests, self._own, _ONE_TEST_S, *(options or ("-x",)))
        finally:
            self.restore()

    def outcomes(self, path: str, source: str, tests: Sequence[str]) -> tuple[Verdict, dict[str, bool]]:
        """Fate of a mutant, and of every function of `tests`, run to the end, whether it failed."""
        self._said.unlink(missing_ok=True)
        verdict = self.judge(path, source, tests, "-rpfE")
        # It said nothing when the time for all tests was over.
        said = self._said.read_text(encoding="utf-8") if self._said.exists() else ""
        failed: dict[str, bool] = {}
        for word, function in _OUTCOME.findall(said):
            failed[function] = failed.get(function, False) or word != "PASSED"
        return verdict, failed

    def restore(self) -> None:
        """Undo the mutant, also one that an end in mid-trial left, and what it compiled."""
        for aside in self._aside.rglob("*.py"):
            shutil.copy2(aside, self.tree / aside.relative_to(self._aside))
        shutil.rmtree(self._aside, ignore_errors=True)
        shutil.rmtree(self._own, ignore_errors=True)

    def _environment(self, cache: Path) -> dict[str, str]:
        # With CI=true hypothesis draws the same examples each time.
        path = os.pathsep.join(str(self.tree / part) for part in PACKAGES)
        return dict(
            os.environ, PYTHONPATH=path, XDG_CACHE_HOME=str(cache), CI="true", PYTHONDONTWRITEBYTECODE="1"
        )

    def _run(self, tests: Sequence[str], cache: Path, one_test_s: int, *options: str) -> Verdict:
        begun = time.monotonic()
        options += ("-q", "-p", "no:cacheprovider", f"--timeout={one_test_s}", "--tb=short")
        process = subprocess.Popen(
            (sys.executable, "-m", "pytest", *options, *tests),
            env=self._environment(cache), cwd=self.tree, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, errors="replace", start_new_session=True,
        )  # fmt: skip
        self._running = process
        try:
            said, _ = process.communicate(timeout=_LIMIT_S)
        except subprocess.TimeoutExpired:
            return Verdict(TIMED_OUT, f"{_LIMIT_S:g} s", time.monotonic() - begun)
        finally:
            self._running = None
            _end(process)
        self._said.write_text(said, encoding="utf-8")
        return _verdict(process.returncode, said, time.monotonic() - begun)


def _end(process: subprocess.Popen[str]) -> None:
    # Also what the tests started and did not live to stop.
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _verdict(status: int, said: str, seconds: float) -> Verdict:
    if status == 0:
        return Verdict(SURVIVED, "", seconds)
    failure = _FIRST_FAILURE.search(said)
    by = failure.group(1) if failure else f"status {status}"
    if "+++ Timeout +++" in said or "Failed: Timeout" in said:
        return Verdict(TIMED_OUT, by, seconds)
    if status in (4, 5):
        raise RuntimeError(f"pytest found no tests:\n{said}")
    if "numba.core.errors.TypingError" in said or "numba.core.errors.LoweringError" in said:
        return Verdict(NOT_COMPILED, by, seconds)
    return Verdict(KILLED, by, seconds)


def stored_verdicts(path: Path) -> dict[str, Verdict]:
    """Newest verdict by mutant: a file of one JSON object a line, whose last may be torn."""
    found: dict[str, Verdict] = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else []:
        try:
            row = json.loads(line)
        except ValueError:
            continue
        ident = row.pop("mutant")
        found[ident] = Verdict(**row)
    return found
