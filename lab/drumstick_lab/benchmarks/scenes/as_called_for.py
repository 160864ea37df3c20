"""Proof that a scene is only what it calls for: drumstick lab as-called-for [--scenes roll,snare] [--library-only].

Each shipped scene is played by two libraries: the whole one, and one from whose registries every effect is taken that
the scene does not name. Strikes and sound must be the same bytes, and the same kernels must be compiled; whose machine
code is not the same is told. Then a rig plays the scene: what it sends in three seconds, what it lists as live values,
and what its panel makes for a visitor's page: controls, and of which values, plots, parts of the picture in 3-D. Stores
lab/results/as_called_for.json, unless of some scenes only; docs/measured.md has the table.
"""

import argparse
import contextlib
import json
import os
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import zenoh
from rig_process import running, wait_for

from drumstick.drum.effects.registry import DRUM_TABLES
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_names, shipped_text
from drumstick.stick.effects.registry import STICK_TABLES
from drumstick_lab.benchmarks.scenes.drawn import drawn_on
from drumstick_lab.checkout import ROOT
from drumstick_lab.measuring import stored

HEARD_S = 3.0
_PANEL = re.compile(r"panel: http://127\.0\.0\.1:(\d+)/\?token=(\S+)")
PARTS = {"drum": DRUM_TABLES, "stick": STICK_TABLES}


def named(scene: Scene) -> dict[str, list[str]]:
    """The effects that a scene names, of its drum and its stick."""
    return {"drum": list(scene.drum.effects), "stick": list(scene.effects)}


def library_with(scene: Scene, folder: Path) -> Path:
    """A copy of the library whose registries have only the effects that the scene names. Modules that one of those
    imports stay, and do nothing."""
    shared = folder / "shared"
    shutil.copytree(ROOT / "shared", shared, ignore=shutil.ignore_patterns("__pycache__"))
    for part, kept in named(scene).items():
        registry = shared / "drumstick" / part / "effects" / "registry.py"
        text = registry.read_text(encoding="utf-8")
        for name in set(PARTS[part]) - set(kept):
            text, lines = re.subn(rf"^    {name},\n", "", text, flags=re.M)
            if lines != 2:  # its import, and its place in the order
                raise RuntimeError(f"{registry}: {name} stands in {lines} lines of its own, and not in 2")
        registry.write_text(re.sub(r"^from \S+ import \(\n\)\n", "", text, flags=re.M), encoding="utf-8")
    return shared


def played(scene: str, shared: Path) -> dict[str, Any]:
    """Findings of code_of with this library, all of it compiled anew."""
    with tempfile.TemporaryDirectory(prefix="drumstick-kernels-") as kernels:
        paths = [shared, ROOT / "services", ROOT / "lab"]
        environment = dict(os.environ, XDG_CACHE_HOME=kernels, PYTHONPATH=os.pathsep.join(map(str, paths)))
        done = subprocess.run(
            [sys.executable, "-m", "drumstick_lab.benchmarks.scenes.code_of", scene],
            env=environment, stdout=subprocess.PIPE, check=True,
        )  # fmt: skip
    return dict(json.loads(done.stdout))


def both(name: str) -> dict[str, Any]:
    """The scene by the whole library, and beside it by one without the other effects."""
    scene = parse(shipped_text(name), name)
    with tempfile.TemporaryDirectory(prefix="drumstick-library-") as folder:
        libraries = (ROOT / "shared", library_with(scene, Path(folder)))
        with ThreadPoolExecutor(2) as processes:  # nothing is timed here
            whole, bare = processes.map(played, (name, name), libraries)
    kernels, others = whole.pop("kernels"), bare.pop("kernels")
    return {
        "effects": named(scene),
        "kernels": sum(map(len, kernels.values())),
        **{key: whole[key] for key in ("stick_bytes", "drum_bytes")},
        "same_strikes": whole["contacts"] == bare["contacts"],
        "same_sound": whole["sound"] == bare["sound"],
        "same_memory": all(whole[key] == bare[key] for key in ("stick_bytes", "drum_bytes")),
        "only_in_whole": sorted(set(kernels) - set(others)),
        "only_in_bare": sorted(set(others) - set(kernels)),
        "other_code": sorted(each for each in kernels if each in others and kernels[each] != others[each]),
    }


def in_a_rig(name: str) -> dict[str, Any]:
    """Messages and live values of a rig that plays the scene, and what its page has."""
    sent: Counter[str] = Counter()
    with running("up", "--scene", name) as rig, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.bind(("127.0.0.1", rig.osc_out))
        ear.settimeout(0.05)
        session = rig.client()
        root = f"drumstick/{rig.name}/"

        def note(sample: zenoh.Sample) -> None:
            sent[f"zenoh {str(sample.key_expr).removeprefix(root)}"] += 1

        subscriber = session.declare_subscriber(root + "*", note)
        begun = time.monotonic()
        while time.monotonic() < begun + HEARD_S:
            with contextlib.suppress(TimeoutError):
                sent["osc " + ear.recv(65536).partition(b"\0")[0].decode()] += 1
        subscriber.undeclare()  # type: ignore[no-untyped-call]
        asked = list(session.get(rig.keys.param("*"), timeout=5.0))
        listed = sorted(str(each.ok.key_expr).rpartition("/")[2] for each in asked if each.ok is not None)
        session.close()  # type: ignore[no-untyped-call]
        # After the messages: a page that is looked at asks for more of them.
        address = wait_for("the panel's address", lambda: _PANEL.search(rig.said))
        port, token = address.groups()
        drawn = drawn_on(int(port), f"drumstick_panel_{port}={token}")
    per_s = {key: round(count / HEARD_S, 1) for key, count in sorted(sent.items())}
    return {"sent_per_s": per_s, "listed": listed, "drawn": drawn._asdict()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", default=",".join(shipped_names()), help="these only; nothing is stored")
    parser.add_argument("--library-only", action="store_true", help="start no rig")
    given = parser.parse_args()
    rows: dict[str, Any] = {}
    for name in given.scenes.split(","):
        rows[name] = both(name)
        live = parse(shipped_text(name), name).hand.hands == 1  # two hands play offline only
        if live and not given.library_only:
            rows[name] |= in_a_rig(name)
        print(name, json.dumps(rows[name]), flush=True)
    if not given.library_only and set(rows) == set(shipped_names()):
        stored.store("as_called_for", {"rows": rows})


if __name__ == "__main__":
    main()
