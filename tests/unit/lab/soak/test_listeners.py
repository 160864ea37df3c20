"""Counting what came, what is missing and what came twice, also where OSC's numbers begin again."""

from drumstick_lab.soak.listeners import OSC_NUMBERS, Sequence
from drumstick_lab.soak.usage import family, is_readable, usage


def test_gaps_repetitions_and_boots() -> None:
    heard = Sequence()
    for boot, seq in ((1, 5), (1, 6), (1, 9), (1, 9), (1, 8), (2, 1), (2, 2)):
        heard.note(boot, seq)
    assert heard.counts() == {"heard": 7, "missing": 2, "again": 2, "boots": 2, "other": 0, "unreadable": 0}


def test_numbers_that_begin_again_are_no_gap() -> None:
    heard = Sequence()
    for seq in (OSC_NUMBERS - 2, OSC_NUMBERS - 1, 0, 1, 3):
        heard.note(0, seq, OSC_NUMBERS)
    assert (heard.missing, heard.again) == (1, 0)


def test_this_process_uses_something() -> None:
    import os

    assert is_readable()
    used = usage(os.getpid())
    assert 1000 < used.pss_kB <= used.rss_kB
    assert used.descriptors >= 3
    assert used.threads >= 1
    assert family(os.getpid())[0] == os.getpid()
