"""A walk over the table of permission that takes every event in every state once, with no more steps than it needs."""

from haptic_server.permission import EVENTS, FREE, STATES, after


def walk() -> list[int]:
    """The events, from FREE on: those that change nothing first, then the one that leads to most that is left."""
    left = {(state, event) for state in range(len(STATES)) for event in range(len(EVENTS))}
    state, events = FREE, list[int]()
    while left:
        event = min(range(len(EVENTS)), key=lambda e: _cost(state, e, left))
        events.append(event)
        left.discard((state, event))
        state = after(state, event)
    return events


def _cost(state: int, event: int, left: set[tuple[int, int]]) -> tuple[bool, bool, int]:
    then = after(state, event)
    waits_there = sum(1 for pair in left if pair[0] == then)
    if (state, event) in left:
        return False, then != state, -waits_there
    return True, waits_there == 0, -waits_there
