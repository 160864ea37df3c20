"""A walk over the table of permission that takes every event in every state at least once."""

from haptic_server.permission import EVENTS, FREE, STATES, after


def walk() -> list[int]:
    """The events, from FREE on: each time the shortest way to one that was not taken in its state yet."""
    left = {(state, event) for state in range(len(STATES)) for event in range(len(EVENTS))}
    state, events = FREE, list[int]()
    while left:
        for event in _way(state, left):
            events.append(event)
            left.discard((state, event))
            state = after(state, event)
    return events


def _way(start: int, left: set[tuple[int, int]]) -> list[int]:
    ways: list[tuple[int, list[int]]] = [(start, [])]
    for state, way in ways:  # grows meanwhile: the short ways are looked at first
        # What changes nothing comes first: the way back from a state that is left may be long.
        steps = sorted(range(len(EVENTS)), key=lambda e, s=state: after(s, e) != s)
        wanted = next((e for e in steps if (state, e) in left), None)
        if wanted is not None:
            return [*way, wanted]
        ways += [(after(state, e), [*way, e]) for e in steps if after(state, e) != state]
    raise AssertionError(f"nothing leads to {left}")
