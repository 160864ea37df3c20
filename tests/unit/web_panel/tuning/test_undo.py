from hypothesis import given
from hypothesis import strategies as st

from web_panel.tuning.undo import MAX_STEPS, UndoHistory


def test_each_change_is_a_step_and_each_step_leads_back() -> None:
    history = UndoHistory()
    history.note({"dv_pls": 0.2, "tau": 0.002}, {"dv_pls": 0.3}, 0.0)
    history.note({"dv_pls": 0.3, "tau": 0.002}, {"tau": 0.004}, 0.1)
    assert [step.before for step in history.back] == [{"dv_pls": 0.2}, {"tau": 0.002}]
    history.undone({"tau": 0.002})
    assert [step.before for step in history.back] == [{"dv_pls": 0.2}]
    history.redone({"tau": 0.004})
    assert [step.after for step in history.back] == [{"dv_pls": 0.3}, {"tau": 0.004}]
    assert history.forth == []


def test_a_drag_is_one_step_and_a_second_drag_another() -> None:
    history = UndoHistory()
    for i, now in enumerate((0.0, 0.9, 1.8)):
        history.note({"dv_pls": 0.2 + i}, {"dv_pls": 1.2 + i}, now)
    assert [(step.before, step.after) for step in history.back] == [({"dv_pls": 0.2}, {"dv_pls": 3.2})]
    history.note({"dv_pls": 3.2}, {"dv_pls": 5.0}, 3.0)
    assert len(history.back) == 2


def test_a_drag_may_wish_before_the_last_wish_was_answered() -> None:
    history = UndoHistory()
    history.note({"dv_pls": 0.2}, {"dv_pls": 0.21}, 0.0)
    history.note({"dv_pls": 0.2}, {"dv_pls": 0.22}, 0.02)
    history.note({"dv_pls": 0.21}, {"dv_pls": 0.23}, 0.04)
    assert [(step.before, step.after) for step in history.back] == [({"dv_pls": 0.2}, {"dv_pls": 0.23})]


def test_what_somebody_else_set_in_between_begins_a_step_however_quick() -> None:
    history = UndoHistory()
    history.note({"dv_pls": 0.2}, {"dv_pls": 0.15}, 0.0)
    history.note({"dv_pls": 0.3}, {"dv_pls": 1.0}, 0.3)
    assert [step.before for step in history.back] == [{"dv_pls": 0.2}, {"dv_pls": 0.3}]


def test_after_a_drag_back_to_where_it_began_the_step_before_stays_as_it_was() -> None:
    history = UndoHistory()
    history.note({"dv_pls": 0.2}, {"dv_pls": 0.3}, 0.0)
    history.note({"dv_pls": 0.3}, {"dv_pls": 0.4}, 5.0)
    history.note({"dv_pls": 0.4}, {"dv_pls": 0.3}, 5.1)
    history.note({"dv_pls": 0.3}, {"dv_pls": 0.5}, 5.2)
    assert [step.before for step in history.back] == [{"dv_pls": 0.2}, {"dv_pls": 0.3}]
    assert history.back[-1].after == {"dv_pls": 0.5}


def test_a_drag_back_to_where_it_began_leaves_nothing() -> None:
    history = UndoHistory()
    history.note({"dv_pls": 0.2}, {"dv_pls": 0.3}, 0.0)
    history.note({"dv_pls": 0.3}, {"dv_pls": 0.2}, 0.5)
    assert history.back == []
    history.note({"dv_pls": 0.2}, {"dv_pls": 0.2}, 9.0)
    assert history.back == []


def test_whole_sets_are_steps_of_their_own_however_quick() -> None:
    history = UndoHistory()
    a, b = {"dv_pls": 0.2, "tau": 0.002}, {"dv_pls": 0.3, "tau": 0.004}
    history.note(a, b, 0.0)
    history.note(b, a, 0.1)
    assert [step.before for step in history.back] == [a, b]


def test_a_new_change_forgets_what_was_undone_and_an_answer_that_comes_twice_counts_once() -> None:
    history = UndoHistory()
    history.note({"dv_pls": 0.2}, {"dv_pls": 0.3}, 0.0)
    history.note({"tau": 0.002}, {"tau": 0.003}, 5.0)
    history.undone({"tau": 0.002})
    history.undone({"tau": 0.002})
    assert len(history.back) == 1
    assert len(history.forth) == 1
    history.note({"dv_pls": 0.3}, {"dv_pls": 0.4}, 9.0)
    assert history.forth == []


@given(
    st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 3), st.sampled_from([0.1, 5.0])), max_size=300)
)
def test_undoing_everything_leads_to_the_start(changes: list[tuple[str, int, float]]) -> None:
    history, now = UndoHistory(), 0.0
    values = dict.fromkeys("abc", 0.0)
    for name, value, apart in changes:
        now += apart
        history.note(dict(values), {name: float(value)}, now)
        values[name] = float(value)
    assert len(history.back) <= MAX_STEPS
    whole = len(history.back) < MAX_STEPS
    while history.back:
        before = history.back[-1].before
        values.update(before)
        history.undone(before)
    assert values == dict.fromkeys("abc", 0.0) or not whole
