"""The page's section on a bank of modes: a result from before rows under tension and a mallet, and one with them."""

from typing import Any

import pytest

from drumstick_lab.measuring.stored import read
from drumstick_lab.pages.measured import measured_drums

ROW = {"f01_Hz": 150.0, "top_Hz": 1e4, "modes": 1000, "tension": True, "mallet": False, "ns": 0.25}
NONE = "Under `tension`, and while a mallet is pressed in, a mode costs more; this result has no rows of it."


def _bank(monkeypatch: pytest.MonkeyPatch, **more: Any) -> list[str]:
    found = {key: value for key, value in read("modal_bank").items() if key != "coupled"} | more
    monkeypatch.setattr(measured_drums, "read", lambda _: found)
    return measured_drums.bank()


def test_an_older_result_has_no_rows_under_tension_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    assert _bank(monkeypatch)[-1] == NONE


def test_each_row_under_tension_or_a_mallet_is_on_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    lines = _bank(monkeypatch, coupled={"8": [ROW, {**ROW, "tension": False, "mallet": True, "ns": 0.5}]})
    assert NONE not in lines
    assert lines[-2:] == [
        "| AVX2 | 150 Hz to 10 kHz | 1000 | yes | no | 0.250 | 1.2% |",
        "| AVX2 | 150 Hz to 10 kHz | 1000 | no | yes | 0.500 | 2.4% |",
    ]


def test_a_row_that_lacks_a_number_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    del_ns = {key: value for key, value in ROW.items() if key != "ns"}
    with pytest.raises(KeyError):
        _bank(monkeypatch, coupled={"8": [del_ns]})
