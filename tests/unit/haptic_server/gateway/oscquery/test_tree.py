"""The tree says what the table of OSC addresses and the parameters' declarations say, and nothing else."""

import pytest

from drumstick.scenes.scene_text import parse
from drumstick.scenes.table import table_of
from haptic_server.gateway.oscquery.tree import ATTRIBUTES, READ, WRITE, tree_of
from osc_bench import FakeParameters, opened_front
from protocol import osc

TABLE = FakeParameters().table
ROOT = tree_of("/drumstick", TABLE)
PLAIN = [row for row in osc.SENT if "NAME" not in row.path]


def test_every_address_that_is_sent_or_heard_is_there_and_no_other() -> None:
    parameters = FakeParameters()
    with opened_front(parameters) as front:
        heard = front.addresses
    sent = {
        osc.address("/drumstick", row, name)
        for row in osc.SENT
        for name in (parameters.table if "NAME" in row.path else [""])
    }
    methods = {node.path for node in ROOT.all() if "TYPE" in node.fixed or node.path.endswith("/pong")}
    assert methods == heard | sent
    writable = {n.path for n in ROOT.all() if n.access & WRITE or "OVERLOADS" in n.fixed}
    assert writable == set(heard)
    assert {n.path for n in ROOT.all() if n.access & READ} == sent - {"/drumstick/pong"}


def test_an_address_is_found_by_its_path_and_by_no_other() -> None:
    for node in ROOT.all():
        assert ROOT.find(node.path) is node
    for path in ("/", "/drumstick/param"):
        found = ROOT.find(path)
        assert found is not None
        assert found.access == 0
        assert "TYPE" not in found.fixed
    for path in ("/drumstick/param/none", "//", "/drumstick/", "/drumstick/../drumstick", "drumstick", ""):
        assert ROOT.find(path) is None


@pytest.mark.parametrize("name", TABLE)
def test_a_parameter_has_its_declared_range_and_unit(name: str) -> None:
    quantity = TABLE[name].quantity
    node = ROOT.find(f"/drumstick/param/{name}")
    assert node is not None
    assert node.fixed["RANGE"] == [{"MIN": quantity.low, "MAX": quantity.high}]
    assert node.fixed["TYPE"] == "f"
    assert node.fixed["ACCESS"] == READ | WRITE
    assert quantity.words in str(node.fixed["DESCRIPTION"])
    units = {"m": "distance.m", "m/s": "speed.m/s", "s": "time.second", "Hz": "time.hz"}
    told = None if quantity.unit == "1" else [units.get(quantity.unit, quantity.unit)]
    assert node.fixed.get("UNIT") == told
    norm = node.children["norm"]
    assert norm.fixed["RANGE"] == [{"MIN": 0.0, "MAX": 1.0}]
    assert "UNIT" not in norm.fixed


@pytest.mark.parametrize(
    ("text", "name", "limits"),
    [("glide_cents = 90", "tension.glide", (0.0, 1200.0)), ("young_GPa = 5", "tension.young", (0.01, 50.0))],
)
def test_of_the_two_that_say_how_a_drum_glides_the_tree_has_the_one_that_counts(
    text: str, name: str, limits: tuple[float, float]
) -> None:
    scene = parse(f"[drum.effects.tension]\n{text}\n", "gliding")
    found = {
        node.path: node for node in tree_of("/drumstick", table_of(scene)).all() if "tension." in node.path
    }
    assert list(found) == [f"/drumstick/param/{name}", f"/drumstick/param/{name}/norm"]
    told = found[f"/drumstick/param/{name}"].fixed["RANGE"]
    assert told == [{"MIN": limits[0], "MAX": limits[1]}]


@pytest.mark.parametrize("row", osc.SENT, ids=lambda row: row.path)
def test_ranges_and_units_have_one_entry_for_each_argument(row: osc.Sent) -> None:
    assert len(row.ranges) in (0, len(row.types))
    assert len(row.units) in (0, len(row.types))


def test_attributes_per_argument_are_as_long_as_the_type() -> None:
    for node in ROOT.all():
        assert set(node.fixed) <= set(ATTRIBUTES)
        for attribute in ("RANGE", "UNIT", "CLIPMODE"):
            told = node.fixed.get(attribute)
            assert told is None or len(told) == len(str(node.fixed["TYPE"])), node.path  # type: ignore[arg-type]


def test_an_address_that_is_heard_otherwise_than_it_is_sent() -> None:
    node = ROOT.find("/drumstick/lease")
    assert node is not None
    assert (node.fixed["TYPE"], node.fixed["ACCESS"]) == ("sf", READ)
    overloads = node.fixed["OVERLOADS"]
    assert isinstance(overloads, list)
    assert [(each["TYPE"], each["ACCESS"]) for each in overloads] == [("s", WRITE)]


def test_panic_alone_is_critical() -> None:
    assert [n.path for n in ROOT.all() if n.fixed.get("CRITICAL")] == ["/drumstick/panic"]


def test_a_deep_prefix_becomes_containers() -> None:
    root = tree_of("/a/b", TABLE)
    assert list(root.children) == ["a"]
    node = root.find("/a/b/param/tau")
    assert node is not None
    assert node.path == "/a/b/param/tau"
