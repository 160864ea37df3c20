"""A study's task: a mistake is one sentence that says where; clicks and lengths follow from the numbers."""

import re
from pathlib import Path

import pytest

from rig.exit_status import GIVEN, CommandError
from rig.study import table, task

BLOCK = 'name = "t"\n[[block]]\nname = "b"\ncondition = "pad"\n'


def read(tmp_path: Path, text: str) -> task.Task:
    path = tmp_path / "task.toml"
    path.write_text(text, encoding="utf-8")
    return task.read(path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name = ", "not TOML"),
        ('name = "t"', "missing required field `block`"),
        (f"{BLOCK}tempoo = 3\n", "unknown field `tempoo`"),
        (f"{BLOCK}strikes = 1.5\n", "Expected `int"),
        (f'{BLOCK}strikes = 9\nrate_Hz = 2\nsource = "drum"\n', "matching regex"),
        (f"{BLOCK}rate_Hz = nan\nstrikes = 9\n", r"block\[0\].rate_Hz"),
        (f"{BLOCK}rate_Hz = 2\ntempo_per_min = 120\nstrikes = 9\n", "block 1, 'b': give tempo_per_min or rate_Hz"),
        (f"{BLOCK}rate_Hz = 2\n", "give strikes or duration_s, to say how long"),
        (f"{BLOCK}rate_Hz = 2\nstrikes = 9\nduration_s = 9\n", "give strikes or duration_s, not both"),
        (f"{BLOCK}strikes = 9\n", "the rate is free: give duration_s"),
        (f'{BLOCK}duration_s = 9\nmetronome = "throughout"\n', "neither metronome nor count_in"),
        (f"{BLOCK}rate_Hz = 2\nstrikes = 9\nsounded = 4\n", "belong together"),
        (f'{BLOCK}rate_Hz = 2\nstrikes = 9\nmetronome = "stops"\n', "belong together"),
        (f'{BLOCK}rate_Hz = 2\nstrikes = 9\nmetronome = "stops"\nsounded = 8\n', "leaves fewer than 2 of 9"),
        (f'{BLOCK}rate_Hz = 2\nduration_s = 0.5\nmetronome = "throughout"\n', "two strikes or more"),
        (f'{BLOCK}rate_Hz = 30\nstrikes = 90\nmetronome = "throughout"\n', "more than 20 clicks a second"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_sentence(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(CommandError, match=words) as stop:
        read(tmp_path, text)
    assert stop.value.status == GIVEN
    assert "\n" not in str(stop.value)


@pytest.mark.parametrize("content", [None, b"\xff"], ids=["none", "no text"])
def test_a_file_that_cannot_be_read(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "task.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(
        CommandError, match="cannot be read: No such file" if content is None else "not UTF-8"
    ):
        task.read(path)


def test_clicks_and_lengths(tmp_path: Path) -> None:
    first, second, third = read(
        tmp_path,
        f'{BLOCK}tempo_per_min = 120\nstrikes = 10\nmetronome = "stops"\nsounded = 5\ncount_in = 2\n'
        '[[block]]\nname = "roll"\ncondition = "stick"\nrate_Hz = 20\nduration_s = 1\nmetronome = "throughout"\n'
        'every = 8\ncount_in = 2\n[[block]]\nname = "free"\ncondition = "stick"\nduration_s = 3\n',
    ).block
    assert (first.interval_s, first.count, first.seconds) == (0.5, 10, 5.0)
    assert first.clicks() == [-2, -1, 0, 1, 2, 3, 4]
    assert (second.count, second.clicks()) == (20, [-16, -8, 0, 8, 16])
    assert (third.interval_s, third.count, third.seconds, third.clicks()) == (None, 0, 3.0, [])


def test_the_pages_task_is_one_and_its_blocks_are_as_told(tmp_path: Path) -> None:
    page = (Path(__file__).resolve().parents[4] / "docs" / "study.md").read_text(encoding="utf-8")
    first, second, third = read(tmp_path, re.findall(r"```toml\n(.*?)```", page, re.DOTALL)[0]).block
    assert (first.interval_s, first.beats, first.counted_in) == (0.4, 20, 4)
    assert (second.count, len(second.clicks())) == (600, 4 + 60)
    assert third.interval_s is None
    assert not [name for name in (*table.STRIKE_COLUMNS, *table.BLOCK_COLUMNS) if f"`{name}`" not in page]
