"""PANIC against a haptic server that answers when it likes."""

import asyncio
import time

from web_panel.rig.answer import Answer
from web_panel.tuning.panic import Panic

TAKEN, SILENT = Answer(), Answer(reason="no answer")


class Asked:
    """Gives these answers one after another, the last one again and again, and notes what was said before each."""

    def __init__(self, *answers: Answer) -> None:
        self.answers = list(answers)
        self.lines: list[str] = []
        self.panic: Panic | None = None

    def __call__(self) -> Answer:
        assert self.panic is not None
        self.lines.append(self.panic.line)
        time.sleep(0.001)
        return self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]


def panic(asked: Asked, asked_for_s: float = 30.0) -> Panic:
    asked.panic = Panic(asked, asked_for_s)
    return asked.panic


def test_it_is_asked_until_it_is_confirmed_and_says_so_meanwhile() -> None:
    asked = Asked(SILENT, SILENT, TAKEN)
    made = panic(asked)
    asyncio.run(made.press())
    assert len(asked.lines) == 3
    assert asked.lines[0] == ""
    assert "not confirmed: no answer" in asked.lines[2]
    assert "it is asked again" in asked.lines[2]
    assert made.line == ""


def test_when_nobody_asks_any_more_it_does_not_say_that_it_is_asked_again() -> None:
    asked = Asked(SILENT)
    made = panic(asked, 0.05)
    asyncio.run(made.press())
    assert "no longer asked" in made.line
    assert "it is asked again" not in made.line
    made.seen(0.0)  # before it was pressed
    assert "no longer asked" in made.line
    asked.answers = [TAKEN]
    asyncio.run(made.press())
    assert made.line == ""


def test_a_latched_panic_that_the_servo_tells_confirms_it_and_nothing_more_is_asked() -> None:
    asked = Asked(SILENT)
    made = panic(asked)

    async def play() -> None:
        pressing = asyncio.create_task(made.press())
        while not made.line:
            await asyncio.sleep(0.001)
        made.seen(time.monotonic())
        await asyncio.wait_for(pressing, 10.0)

    asyncio.run(play())
    assert made.line == ""


def test_an_answer_to_one_press_confirms_the_other_one() -> None:
    # The button and its key: two presses for one click.
    asked = Asked(SILENT, SILENT, SILENT, SILENT, TAKEN, SILENT)
    made = panic(asked)

    async def both() -> None:
        await asyncio.wait_for(asyncio.gather(made.press(), made.press()), 10.0)

    asyncio.run(both())
    assert made.line == ""
