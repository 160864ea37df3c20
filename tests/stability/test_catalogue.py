"""The catalogue and the suite agree: each case is shown, and each tie leads to a case."""

from collections import Counter

import pytest

from stability.catalogue import CASES, HALVES, SUBJECTS, shows, ties


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_each_case_is_shown_with_its_naive_method_and_with_ours(case) -> None:
    shown = {half for tie in ties() if tie.case == case.name for half in tie.halves}
    assert shown == set(HALVES)


def test_each_tie_is_to_a_case_and_by_a_test() -> None:
    found = ties()
    assert {tie.case for tie in found} <= {case.name for case in CASES}
    assert {half for tie in found for half in tie.halves} <= set(HALVES)
    assert all(tie.test.startswith("test_") for tie in found)


def test_a_case_that_is_not_there_cannot_be_tied() -> None:
    with pytest.raises(LookupError, match="no hard case is called 'easy'"):
        shows("easy")


def test_a_case_has_one_name_a_subject_and_words() -> None:
    assert [name for name, count in Counter(case.name for case in CASES).items() if count > 1] == []
    for case in CASES:
        assert case.of in SUBJECTS
        for words in (case.hard, case.naive, case.ours, case.bound):
            assert words.endswith(".")
            assert "|" not in words, "it would break the table of the page"
