"""The tables: what they say, and that nothing from the network is taken for HTML."""

import numpy as np
import pytest

from protocol.announced import Deviation, Report
from protocol.messages import Cost, Meter
from web_panel.computing.computing_messages import Ticks, Trouble
from web_panel.views import html_tables
from web_panel.views.cost import sounding
from web_panel.views.health import lateness_of

NASTY = "<script>alert(1)</script>"


def cost(accuracy: str, share: float) -> Cost:
    return Cost(
        id="s",
        words=f"mesh {NASTY}",
        accuracy=accuracy,
        mesh_rate_Hz=16000.0,
        across=66.7,
        share=share,
        cents=0.5,
    )


def meter() -> Meter:
    return Meter(
        id="s", t_ns=0, sink=NASTY, peak_left=0.1, peak_right=0.1, load=0.02, xruns=3, latency_ms=5.0, played=100,
        late=2, duplicates=0, underflows=4, arrival_ms=1.25, jitter_ms=0.5, unpunctual=5,
    )  # fmt: skip


def test_the_cost_of_another_mesh_is_what_this_one_takes_times_its_share() -> None:
    drum = {"now": cost("now", 1.0), "fine": cost("fine", 4.0)}
    found = html_tables.cost(Ticks({"all": 300.0, "pulse": 250.0, "none": 240.0}, 1000.0), drum, (0.02, 0.05))
    assert "<td>2 %</td>" in found
    assert "<td>about 8 %</td>" in found
    assert "<td>0.5 cents</td>" in found
    assert "at most 5 %" in found
    assert "<td>300 ns</td><td>0.03 %</td>" in found
    assert "<td>of that pulse</td><td>50 ns</td>" in found
    assert NASTY not in found


@pytest.mark.parametrize("told", [None, Trouble(NASTY)])
def test_what_is_not_known_is_said(told: Trouble | None) -> None:
    found = html_tables.cost(told, {}, None)
    assert "no sound server reports" in found
    assert "measured" in found
    assert NASTY not in found


def test_a_bank_of_modes_has_no_other_mesh() -> None:
    assert "<table" not in html_tables.cost(None, {"now": cost("now", 1.0)}, None)


def test_the_load_is_that_of_a_drum_that_sounds() -> None:
    assert sounding([]) is None
    assert sounding([0.0, 0.0, 0.02, 0.022, 0.03, 0.001]) == (0.022, 0.03)


def test_who_is_there_and_what_the_network_does() -> None:
    found = html_tables.health([meter()], {f"panel/{NASTY}", "panel/b", f"{NASTY}/a"}, 1, None, None, None)
    assert "2 panel; 1 browser on this page" in found
    assert "<td>1.25 ms</td><td>0.50 ms</td><td>7 of 102</td><td>4</td><td>3</td>" in found
    assert "does not answer" in found
    assert "no contact was heard from beginning to end yet" in found
    assert NASTY not in found
    announced = Report(12, Deviation(0.04, -3.21), Deviation(-0.01, 0.4))
    found = html_tables.health([], set(), 1, None, None, announced)
    assert "the last 12 contacts: peak force announced +0.0 dB (worst -3.2 dB), impulse +0.0 dB" in found


def test_lateness_is_read_with_care() -> None:
    found = lateness_of({"lateness": {"bin_us": 10.0, "ticks": [7, 0, 2]}})
    assert found is not None
    assert found[0].tolist() == [5.0, 15.0, 25.0]
    assert found[1] == pytest.approx([7.0, np.nan, 2.0], nan_ok=True)


@pytest.mark.parametrize(
    "doctor",
    [None, {}, {"lateness": 5}, {"lateness": {}}, {"lateness": {"bin_us": "x", "ticks": [1, 2]}},
     {"lateness": {"bin_us": 10.0, "ticks": [1, "2"]}}, {"lateness": {"bin_us": 10.0, "ticks": [1, -2]}}],
)  # fmt: skip
def test_what_is_no_lateness_is_not_drawn(doctor: dict[str, object] | None) -> None:
    assert lateness_of(doctor) is None
