"""Coverage-guided fuzzing of all that reads bytes from outside: drumstick lab fuzz [--seconds 60].

Atheris runs the readers of fuzz_targets.py and keeps every input that reaches a new branch. What it kept is stored, as
small as it can be made, in lab/drumstick_lab/benchmarks/robustness/corpus/TARGET.txt (base64, one input a line), and the next run starts from there.
Stores lab/results/fuzz.json; an input that breaks a promise lies in lab/drumstick_lab/benchmarks/robustness/found/ and is named. Exit status
1 when there was one. `--check`: neither corpus nor result is written.
"""

import argparse
import base64
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import atheris
from atheris.import_hook import instrument_imports

from drumstick_lab.benchmarks.robustness.fuzz_targets import MAKERS, PLANTED, TRACED

HERE = Path(__file__).parent
CORPUS = HERE / "corpus"
_LONGEST = 8192  # bytes of an input
_OPTIONS = [
    "-timeout=10",
    "-rss_limit_mb=1500",
    f"-max_len={_LONGEST}",
    "-print_final_stats=1",
    "-verbosity=1",
]


def child(target: str, arguments: list[str]) -> None:
    """Hand this process over to libFuzzer: it does not come back. arguments: of libFuzzer, its own program first."""
    with instrument_imports(include=TRACED[target]):
        made = MAKERS[target]()
    if arguments == ["--seeds"]:
        print(json.dumps([base64.b64encode(seed).decode() for seed in made.seeds]))
        return
    atheris.Setup(arguments, made.feed)
    atheris.Fuzz()


def run(target: str, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A child with these arguments for libFuzzer, which starts itself again when it merges: by a script in `folder`."""
    program = folder / "fuzzer"
    itself = shlex.join(
        [
            sys.executable,
            "-m",
            "drumstick_lab.benchmarks.robustness.fuzz",
            "--child",
            target,
            "--",
            str(program),
        ]
    )
    program.write_text(f'#!/bin/sh\nexec {itself} "$@"\n', encoding="utf-8")
    program.chmod(0o700)
    surroundings = dict(os.environ, TMPDIR=str(folder))  # what a target leaves goes with the folder
    return subprocess.run(
        [program, *arguments], capture_output=True, text=True, check=False, env=surroundings
    )


def seeds(target: str, folder: Path) -> list[bytes]:
    """Good inputs, as the target's own writers make them."""
    command = [
        sys.executable,
        "-m",
        "drumstick_lab.benchmarks.robustness.fuzz",
        "--child",
        target,
        "--",
        "--seeds",
    ]
    surroundings = dict(os.environ, TMPDIR=str(folder))
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=surroundings)
    if done.returncode != 0:
        raise RuntimeError(f"{target}: {done.stderr[-2000:]}")
    return [base64.b64decode(line) for line in json.loads(done.stdout)]


def kept(target: str) -> list[bytes]:
    """The stored corpus."""
    path = CORPUS / f"{target.replace(' ', '_')}.txt"
    return (
        [base64.b64decode(line) for line in path.read_text(encoding="ascii").split()] if path.exists() else []
    )


def keep(target: str, inputs: list[bytes]) -> None:
    """Store it, shortest first."""
    CORPUS.mkdir(exist_ok=True)
    lines = [base64.b64encode(data).decode() for data in sorted(inputs, key=lambda d: (len(d), d))]
    path = CORPUS / f"{target.replace(' ', '_')}.txt"
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def fuzz(target: str, seconds: int, seed: int, found: Path, is_check: bool) -> dict[str, Any]:
    """One target for so long; what came of it."""
    with tempfile.TemporaryDirectory(prefix="drumstick-fuzz-") as folder:
        old, small = Path(folder) / "old", Path(folder) / "small"
        old.mkdir()
        small.mkdir()
        known = kept(target)
        for number, data in enumerate([*seeds(target, Path(folder)), *known]):
            (old / f"{number:05d}").write_bytes(data)
        found.mkdir(exist_ok=True)
        prefix = f"-artifact_prefix={found}/{target.replace(' ', '_')}-"
        done = run(
            target, Path(folder), *_OPTIONS, f"-max_total_time={seconds}", f"-seed={seed}", prefix, str(old)
        )
        row = {"seconds": seconds, "seed": seed, **_row(done.stderr, known=len(known))}
        if done.returncode != 0:
            row["found"] = done.stderr[-3000:]
            print(done.stderr[-3000:])
        if not is_check:
            merged = run(target, Path(folder), *_OPTIONS[:3], "-merge=1", str(small), str(old))
            if merged.returncode != 0:
                raise RuntimeError(f"{target}: {merged.stderr[-2000:]}")
            keep(target, [path.read_bytes() for path in small.iterdir()])
            row["corpus"] = len(kept(target))
    return row


def _row(said: str, known: int) -> dict[str, Any]:
    def last(pattern: str) -> int:
        found = re.findall(pattern, said)
        return int(found[-1]) if found else 0

    return {
        "inputs": last(r"number_of_executed_units: +(\d+)"),
        "inputs_per_s": last(r"average_exec_per_sec: +(\d+)"),
        "branches": last(r"cov: (\d+)"),
        "known_before": known,
    }


def main() -> int:
    if sys.argv[1:2] == ["--child"]:
        child(sys.argv[2], sys.argv[4:])
        return 0
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=int, default=60, help="for each target")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--target", choices=sorted(MAKERS), action="append")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--found", type=Path, default=HERE / "found", help="folder for what breaks a promise")
    args = parser.parse_args()
    # Not above: what a child fuzzes must be imported there first, under the instruments.
    from drumstick_lab.measuring import stored

    result = stored.read("fuzz") if stored.exists("fuzz") else {"targets": {}}
    is_good = True
    for target in args.target or sorted(MAKERS.keys() - {PLANTED}):
        row = fuzz(target, args.seconds, args.seed, args.found, args.check)
        is_good = is_good and "found" not in row
        result["targets"][target] = row
        print(
            f"{target}: {row['inputs']} inputs, {row['branches']} branches"
            + ("" if "found" not in row else ": FOUND")
        )
    if not args.check:
        stored.store("fuzz", result)
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main())
