"""The made pages under docs/ say what the code and the stored results say."""

import importlib
import json
import re
import sys
from types import ModuleType
from xml.etree import ElementTree

import pytest
import soundfile

from drumstick.scenes.scene_text import parse, shipped_names
from drumstick_lab.programs import module_of
from protocol.description import ZENOH
from protocol.keys import Keys

_SVG = "{http://www.w3.org/2000/svg}"


def _tool(name: str) -> ModuleType:
    return importlib.import_module(module_of(name))


@pytest.mark.parametrize(
    "name",
    [
        "accuracy_page",
        "zenoh_page",
        "hard_cases_page",
        "measured_page",
        "mesh_page",
        "methods_page",
        "permission_page",
        "recordings_page",
        "safety_page",
        "scaling_page",
        "scenes_page",
        "security_page",
        "servo_page",
        "sounds_page",
        "stick_page",
    ],
)
def test_the_page_is_up_to_date(name: str) -> None:
    tool = _tool(name)
    made = tool.page()
    assert tool.PAGE.read_text(encoding="utf-8") == made, (
        f"run: .venv/bin/drumstick lab {name.replace('_', '-')}"
    )


def test_the_description_for_programs_is_up_to_date_and_whole() -> None:
    tool = _tool("zenoh_page")
    assert tool.DESCRIPTION.read_text(encoding="utf-8") == tool.description()
    keys = {name for name in vars(Keys) if not name.startswith("_") and name != "rig"}
    assert {use.member for use in ZENOH} == keys
    described = json.loads(tool.description())
    for row in described["zenoh"]["keys"]:
        assert row["payload"] in described["payloads"] or (
            row["payload"] == "" and row["kind"] in ("query", "token")
        )
        assert row["description"]
    for kind in described["payloads"].values():
        assert len(kind["fields"]) == len(kind["prefixItems"])


def test_the_load_that_is_counted_is_that_of_the_messages_as_they_are() -> None:
    tool = _tool("scaling_page")
    from drumstick.drum.membrane import surface

    load = sys.modules["drumstick_lab.rig_load"]
    assert (load.RINGS, load.SPOKES) == (surface.RINGS, surface.SPOKES)
    states = load.STREAMS["state"]
    assert states.key == Keys(load.RIG).state
    assert 100 < states.payload_bytes < 200
    router = tool.router_of(
        {
            "rows": [
                {
                    "listeners": n,
                    "delivered_share": 1.0 if n < 100 else 0.9,
                    "router_cpu_us_per_delivery": (50.0 + 7.0 * n) / n,
                    "bytes_per_delivery": 200,
                }
                for n in (1, 10, 30, 100)
            ]
        }
    )
    assert (round(router.own_us, 6), round(router.each_us, 6)) == (50.0, 7.0)
    rows = [
        {"listeners": n, "delivered_share": share, "p99_us": p99_us}
        for n, share, p99_us in (
            (1, 1.0, 900.0),
            (30, 1.0, 49_000.0),
            (100, 0.9, 40_000.0),
            (300, 1.0, 51_000.0),
        )
    ]
    assert tool.most_in_time(rows) == 30
    assert tool.ceilings("follower", router, rows)["99 of 100 strikes in time, simulated below"] == 30.0
    assert tool.ceilings("follower", router, rows[:2])["the most that were simulated below, in time"] == 30.0
    limits = tool.ceilings("follower", router, rows)
    assert list(limits.values()) == sorted(limits.values())
    most = limits["one core of a router"]
    assert abs(router.share(load.per_s("follower"), most) - 1.0) < 1e-9


def test_the_sounds_are_those_of_the_shipped_scenes() -> None:
    tool = _tool("sounds_page")
    stored = json.loads(tool.STORED.read_text(encoding="utf-8"))
    assert list(stored) == tool.names()
    assert set(shipped_names()) < set(stored)
    stale = [name for name in stored if stored[name]["digest"] != tool.digest(name)]
    assert stale == [], "run: .venv/bin/drumstick lab sounds-page"
    for name in stored:
        sound, rate_Hz = soundfile.read(tool.sound_of(name))
        assert (rate_Hz, sound.shape) == (48_000, (round(48_000 * stored[name]["duration_s"]), 2))
        assert abs(sound).max() == pytest.approx(stored[name]["peak"], abs=2e-3)
    assert sum(path.stat().st_size for path in tool.SOUNDS.iterdir()) < 6_000_000
    assert tool.stale_pictures() == [], "run: .venv/bin/drumstick lab sounds-page"


def test_the_pictures_of_accuracy_are_those_of_its_result_and_of_the_code() -> None:
    tool = _tool("accuracy_page")
    assert tool.stale_pictures() == [], "run: .venv/bin/drumstick lab accuracy-page"
    shown = re.findall(r"images/(accuracy-[\w-]+\.png)", tool.PAGE.read_text(encoding="utf-8"))
    assert sorted(shown) == sorted(path.name for path in (tool.DOCS / "images").glob("accuracy-*.png"))


def test_the_points_of_the_whole_way_say_what_they_are_each_once() -> None:
    tool = _tool("accuracy_page")
    found = tool.shipped()["whole"]
    drawn = ElementTree.parse(tool.POINTS).getroot()
    marks = [each for each in drawn.iter(f"{_SVG}g") if each.get("class") == "choice"]
    said = [mark.findtext(f"{_SVG}title") or "" for mark in marks]
    priced = [
        row for row in found["rows"] if row["share_of_core"] is not None and row["stage"] != "reference"
    ]
    assert len(said) == len(set(said)) == len(priced)
    assert all(mark.get("tabindex") == "0" for mark in marks)
    for row in priced:
        (words,) = [each for each in said if each.startswith(f"{row['stage']}: {tool.named(row)}. ")]
        assert f"Error: {row['jnds']:.2g} JND" in words
        assert f"{100.0 * row['share_of_core']:.2g} % of a core" in words
        assert ("Nobody should choose it" in words) == any(
            row is worse for worse, _ in tool.never(found["rows"])
        )
        if row["latency_ms"] is not None:
            assert f"latency of its own: {row['latency_ms']:.2g} ms" in words
    scripts = {f"{_SVG}script", f"{_SVG}image"}
    assert not [each for each in drawn.iter() if each.tag in scripts]


def test_the_pictures_of_the_stick_are_those_of_its_page_and_of_the_code() -> None:
    tool = _tool("stick_page")
    assert tool.stale_pictures() == [], "run: .venv/bin/drumstick lab stick-page"
    shown = re.findall(r"images/(stick-[\w-]+\.png)", tool.PAGE.read_text(encoding="utf-8"))
    assert sorted(shown) == sorted(path.name for path in (tool.DOCS / "images").glob("stick-*"))
    assert sum((tool.DOCS / "images" / name).stat().st_size for name in shown) < 1_000_000


def test_what_the_set_ups_of_accuracy_say_nothing_about_is_what_a_scene_has() -> None:
    silent = parse("", "silent")
    assert (silent.drum.excitation, silent.mesh.accuracy) == ("analytic", "standard")
    assert (silent.servo.rate_Hz, silent.servo.predictor) == (1000, "lead")
