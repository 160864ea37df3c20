from sound_server.haptic_clock import RoundTrip, clock_from


def test_the_shortest_round_trip_counts() -> None:
    clock = clock_from(
        [RoundTrip(0, 100, 7, 1049), RoundTrip(200, 210, 7, 1205), RoundTrip(300, 400, 7, 1399)]
    )
    assert clock is not None
    assert (clock.offset_ns, clock.error_ns) == (1000, 5)
    assert clock.ours(1500) == 500
    assert clock.haptic(500) == 1500


def test_a_restart_in_between_counts_only_what_came_after() -> None:
    clock = clock_from([RoundTrip(0, 2, 7, 5001), RoundTrip(10, 30, 8, 120)])
    assert clock is not None
    assert (clock.boot, clock.offset_ns) == (8, 100)


def test_without_answers_there_is_no_clock() -> None:
    assert clock_from([]) is None
