"""Origin of a result, as pages tell it: when, where and of which version it was measured, and whether that still holds."""

from collections import Counter
from collections.abc import Mapping
from functools import cache
from typing import Any

from drumstick_lab import checkout
from drumstick_lab.measuring.catalogue import CATALOGUE, sources_of
from drumstick_lab.measuring.source_hash import source_hash
from drumstick_lab.measuring.stored import read

USUAL = "[as most](measured.md#the-machine-of-most-figures)"


def machine_of(machine: Mapping[str, Any]) -> tuple[Any, ...]:
    """Processor, cores, kernel, Python, numba, numpy: two results with the same are from one machine."""
    packages = machine.get("packages", {})
    here = (machine.get(name) for name in ("processor", "cores", "system", "python"))
    return (*here, packages.get("numba"), packages.get("numpy"))


def is_of_these_sources(name: str, machine: Mapping[str, Any]) -> bool | None:
    """True when what the result measures has not changed since; None when it does not say of what it was."""
    if not sources_of(name):
        return True
    made_of = machine.get("sources")
    return None if made_of is None else made_of == source_hash(sources_of(name))


@cache
def most_common_machine() -> tuple[Any, ...]:
    """The machine of most stored results: that of the last `drumstick lab measure --all`, once there was one."""
    stored = sorted(file.stem for file in checkout.RESULTS.glob("*.json") if file.stem in CATALOGUE)
    found = Counter(machine_of(read(name).get("machine", {})) for name in stored)
    return found.most_common(1)[0][0]


def marks(name: str, result: Mapping[str, Any]) -> list[str]:
    """Warnings to who compares it: stale, of unknown sources, from another machine than most results."""
    machine = result.get("machine", {})
    found = {
        True: [], None: ["May be stale: its version is not known."], False: ["Stale: the code has changed since."],
    }[is_of_these_sources(name, machine)]  # fmt: skip
    here, most = machine_of(machine), most_common_machine()
    if here != most:
        software = here[:2] == most[:2]
        found.append(
            "With other versions of system or packages than most."
            if software
            else "From another machine than most."
        )
    return found


def _in_words(machine: Mapping[str, Any]) -> dict[str, str | None]:
    processor, cores, system, python, numba, numpy = machine_of(machine)
    return {
        "processor": processor or None,
        "cores": cores and f"{cores} cores",
        "kernel": system and system.partition("-with-")[0],  # without the C library's version
        "Python": python and f"Python {python}",
        "numba": numba and f"numba {numba}",
        "numpy": numpy and f"numpy {numpy}",
    }


def _of_the_run(machine: Mapping[str, Any]) -> dict[str, str | None]:
    priority, version = machine.get("real_time_priority"), machine.get("commit")
    before, after = machine.get("load_before"), machine.get("load_after")
    return {
        "version": version and f"version {version}",
        "real-time priority": None if priority is None else f"real-time priority {priority}",
        "load": None if None in (before, after) else f"load {before:.1f} before, {after:.1f} after",
    }


def usual_machine() -> str:
    """The machine of most results in words, which a page tells once."""
    processor, cores, system, python, numba, numpy = most_common_machine()
    packages = {"numba": numba, "numpy": numpy}
    usual = {"processor": processor, "cores": cores, "system": system, "python": python, "packages": packages}
    return ", ".join(words for words in _in_words(usual).values() if words is not None)


def where(result: Mapping[str, Any]) -> str:
    """Date, what of the machine differs from that of most, version, priority and load; without a full stop.

    What is not known stands at the end.
    """
    machine = result.get("machine", {})
    here, run = _in_words(machine), _of_the_run(machine)
    alike = [a == b for a, b in zip(machine_of(machine), most_common_machine(), strict=True)]
    known_here = [
        (words, same) for words, same in zip(here.values(), alike, strict=True) if words is not None
    ]
    differs = [words for words, same in known_here if not same]
    usual = [f"{'otherwise' if differs else 'machine'} {USUAL}"] if len(differs) < len(known_here) else []
    told = [machine.get("date"), *differs, *usual, *run.values()]
    missing = [name for name, said in {"date": told[0], **here, **run}.items() if said is None]
    known = ", ".join(said for said in told if said is not None)
    return "; ".join(filter(None, (known, f"not known: {', '.join(missing)}" if missing else "")))


def line(name: str) -> str:
    """One line of a page under the heading of what is made from a result."""
    result, why = read(name), CATALOGUE[name].by_hand
    by_hand = [f"*Made by hand, not in the run of all the others: {why}.*"] if why else []
    return " ".join((f"*{where(result)}.*", *by_hand, *(f"**{mark}**" for mark in marks(name, result))))


def heading(words: str, *names: str) -> list[str]:
    """A heading and, under it, where its results come from, one line each."""
    named = {name: f"`{name}.json`: " if len(names) > 1 else "" for name in names}
    return [words, "", *(each for name in names for each in (named[name] + line(name), ""))]
