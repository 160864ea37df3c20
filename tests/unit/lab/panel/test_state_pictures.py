"""Pictures of the page's states: whole on their sheet, none over another, the words below."""

import base64
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from PIL import Image, ImageColor

from drumstick_lab.benchmarks.panel.state_pictures import StatePictures, contact_sheet

COLOURS = ("red", "green", "blue", "orange")


@pytest.fixture
def pictures(tmp_path: Path) -> list[tuple[str, Path]]:
    made = [
        (f"a state that is {colour}, told in more words than one line holds", colour) for colour in COLOURS
    ]
    for _, colour in made:
        Image.new("RGB", (390, 844), colour).save(tmp_path / f"{colour}.png")
    return [(words, tmp_path / f"{colour}.png") for words, colour in made]


def test_each_picture_is_on_the_sheet_as_large_as_the_others(pictures: list[tuple[str, Path]]) -> None:
    sheet = np.asarray(contact_sheet(pictures))
    boxes: list[tuple[int, int, int, int]] = []
    for colour in COLOURS:
        down, across = np.nonzero((sheet == ImageColor.getrgb(colour)).all(axis=2))
        height, width = int(np.ptp(down)) + 1, int(np.ptp(across)) + 1
        assert len(down) == height * width, "something lies over it"
        assert height / width == pytest.approx(844 / 390, rel=0.01)
        boxes.append((int(across.min()), int(down.min()), width, height))
    assert len({(top, width, height) for _, top, width, height in boxes}) == 1
    left, top, width, height = boxes[0]
    below = sheet[top + height :, left : left + width]
    assert (below < 128).any(), "no words"
    assert (sheet[top + height :, left + width : boxes[1][0]] == 255).all(), "words beyond their picture"


def test_a_sheet_of_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="needs a picture"):
        contact_sheet([])


def test_a_picture_is_taken_where_the_state_is_seen_with_its_folder_open(
    pictures: list[tuple[str, Path]], tmp_path: Path
) -> None:
    closed, part = Mock(), Mock()
    closed.get_attribute.return_value, part.get_attribute.return_value = "false", None
    page, chrome = Mock(), Mock()
    page.locator.side_effect = {"folder": Mock(first=closed), "part": Mock(first=part)}.__getitem__
    shot: dict[str, Any] = {"data": base64.b64encode(pictures[0][1].read_bytes()).decode()}
    chrome.send.return_value = shot
    taken = StatePictures(tmp_path / "taken")
    taken.take(page, chrome, (390, 844), "panic: it stays", ("folder", "part"))
    closed.click.assert_called_once_with()
    part.click.assert_not_called()
    part.evaluate.assert_called_once()
    (sheet,) = taken.sheets()
    assert sheet == tmp_path / "taken" / "panel-states-390x844.png"
    assert (tmp_path / "taken" / "390x844" / "00-panic-it-stays.png").read_bytes() == pictures[0][
        1
    ].read_bytes()
    with Image.open(sheet) as drawn:
        assert drawn.mode == "P"
