"""Position of a slider that browsers and the main thread both move."""

import viser


class SliderPosition:
    """Left alone for one turn of the main thread when a browser has moved it, and one more when its request is noted.

    For viser writes a browser's position into the handle before it calls anybody, and the main thread may have looked
    for requests just before one was noted. Moved back in between, the slider would lose a step: the next press of an
    arrow key sets out from where the page shows it.
    """

    def __init__(self, handle: viser.GuiSliderHandle[float]) -> None:
        self.handle = handle
        self._noted: float | None = handle.value  # None: its next turn is left alone

    def note(self) -> None:
        """A browser moved it, and what it asks for is noted. viser's thread."""
        self._noted = None

    def stand_at(self, position: float, tolerance: float) -> None:
        """Move it here if it is further away than this. Main thread."""
        present = self.handle.value
        if present != self._noted:
            self._noted = present  # if nothing is asked for by the next turn, nobody will
        elif abs(present - position) > tolerance:
            self._noted = position
            self.handle.value = position
