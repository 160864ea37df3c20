"""docs/osc.md tells what is so."""

from pathlib import Path

import pytest

from drumstick.parameters.scene import Scene
from drumstick.scenes.table import table_of
from drumstick.stick.effects.pulse import Pulse
from protocol import osc

PAGE = (Path(__file__).parents[2] / "docs" / "osc.md").read_text(encoding="utf-8")
_SENT, _HEARD = PAGE.split("## What the rig hears")
_HEARD = _HEARD.split("## Try it")[0]


def _line(part: str, path: str) -> str:
    where = f"`{osc.DEFAULT_PREFIX}{path}`"
    found = [line for line in part.splitlines() if line.startswith("|") and where in line]
    assert len(found) == 1, f"{where} stands in {len(found)} rows"
    return found[0]


@pytest.mark.parametrize("row", osc.SENT, ids=lambda row: row.path)
def test_what_is_sent_is_listed_with_its_types(row: osc.Sent) -> None:
    assert f"| `{row.types}` |" in _line(_SENT, row.path) or row is osc.PONG


@pytest.mark.parametrize("row", osc.INCOMING, ids=lambda row: row.path)
def test_what_is_heard_is_listed_with_its_forms(row: osc.Incoming) -> None:
    types = _line(_HEARD, row.path).split("|")[2]
    for form in row.forms:
        assert (f"`{form}`" if form not in ("", "any") else form or "none") in types


def test_nothing_else_is_listed() -> None:
    for part, rows in ((_SENT, osc.SENT), (_HEARD, osc.INCOMING)):
        named = {
            cell.strip(" `")
            for line in part.splitlines()
            if line.startswith("| `/")
            for cell in line.split("|")[1].split(",")
        }
        assert named == {osc.DEFAULT_PREFIX + row.path for row in rows}


def test_ports_and_parameter_names() -> None:
    assert f"`{osc.DEFAULT_IN[0]}`, port {osc.DEFAULT_IN[1]}" in PAGE
    assert f"`{osc.DEFAULT_OUT[0]}`, port {osc.DEFAULT_OUT[1]}" in PAGE
    table = table_of(Scene("roll", effects={"pulse": Pulse()}))
    for name, row in table.items():
        assert f"`{name}`" in _HEARD
        assert (row.quantity.scale == "log") == (name in ("m", "k_coll", "tau", "drum.f01", "drum.t60"))
