"""Data of the plots: ten seconds, each contact's v_E beside the next one's."""

import numpy as np
import pytest

from protocol.messages import Release, State
from rig_messages import state as some_state
from rig_messages import strike
from web_panel.rig.history import PlotHistory
from web_panel.rig.rig_state import RigState


def state(strikes: int, v_e: float, z_m: float = 0.01, boot: int = 1) -> State:
    return some_state(boot=boot, z_m=z_m, v_m_per_s=0.1, roll_rate_Hz=20.0, v_e_m_per_s=v_e, strikes=strikes)


def told(*states: State, at: float = 0.0) -> PlotHistory:
    history, rig_state = PlotHistory(), RigState()
    for i, each in enumerate(states):
        rig_state.note_state(each, at + 0.01 * i)
    history.take(rig_state, at + 1.0)
    return history


def test_each_contact_stands_beside_the_next() -> None:
    history = told(state(1, 0.3), state(1, 0.3), state(2, 0.4), state(3, 0.45))
    assert history.steps().T.tolist() == [[0.3, 0.4], [0.4, 0.45]]


def test_contacts_that_were_not_heard_make_no_pair() -> None:
    assert told(state(1, 0.3), state(3, 0.4), state(4, 0.5)).steps().T.tolist() == [[0.4, 0.5]]


def test_in_the_head_the_speed_is_still_that_of_the_contact_before() -> None:
    history = told(state(1, 0.3), state(2, 0.3, z_m=-0.001), state(2, 0.4), state(3, 0.5))
    assert history.steps().T.tolist() == [[0.3, 0.4], [0.4, 0.5]]


def test_a_new_start_counts_anew() -> None:
    history = told(state(8, 0.3), state(9, 0.4), state(1, 0.5, boot=2), state(2, 0.6, boot=2))
    assert history.steps().T.tolist() == [[0.5, 0.6]]


def test_what_is_older_than_ten_seconds_is_gone() -> None:
    history, rig_state = PlotHistory(), RigState()
    rig_state.note_state(state(1, 0.3), 0.0)
    rig_state.new_releases.append(
        (
            0.0,
            Release(
                boot=1, seq=1, t_ns=0, exit_speed_m_per_s=0.1, impulse_N_s=0.1, peak_N=5.0, contact_s=0.004
            ),
        )
    )
    history.take(rig_state, 1.0)
    assert history.roll(1.0)[0] == pytest.approx([-1.0])
    assert history.contacts(1.0) == pytest.approx(np.array([[-1.0], [4.0], [5.0]]))
    assert history.orbit(1.0, 3.0) == pytest.approx(np.array([[10.0], [0.1]]))
    assert history.orbit(1.0, 0.5).shape == (2, 0)
    rig_state.forget_news()
    history.take(rig_state, 10.5)
    assert history.roll(10.5).shape == (4, 0)
    assert history.contacts(10.5).shape == (3, 0)
    assert history.steps().shape == (2, 0)


def test_strikes_are_kept_with_their_levels_for_ten_seconds() -> None:
    history, rig_state = PlotHistory(), RigState()
    for seq, at in enumerate((0.0, 5.0, 12.0)):
        rig_state.note_strike(strike(seq=seq, z_speed_m_per_s=0.1 * at, level=0.05 * at), at)
    history.take(rig_state, 12.0)
    assert pytest.approx(np.array([[0.5, 0.25], [1.2, 0.6]])) == history.strikes().T
