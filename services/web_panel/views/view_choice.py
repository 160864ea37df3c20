"""Choice of view for each browser: one at a time, by a row of buttons.

viser does not tell which folders a browser has open. So each browser has its own choice, and only what it looks at is
asked for, computed and sent. Main thread, but for `_choose`, which runs in viser's and only notes the choice.
"""

import warnings
from collections.abc import Callable
from typing import NamedTuple

import viser

from web_panel.access.client_message import ClientMessages
from web_panel.access.viser_access import control_id
from web_panel.accuracy_results import Files
from web_panel.computing.computer import Computer
from web_panel.page import markup
from web_panel.rig.history import PlotHistory
from web_panel.rig.rig_state import RigState
from web_panel.rig.view_subscriptions import MEMBRANE, STRIKES
from web_panel.views.accuracy import AccuracyView
from web_panel.views.cost import CostView
from web_panel.views.health import HealthView
from web_panel.views.level import LevelView
from web_panel.views.phase_plane import PhasePlaneView
from web_panel.views.plot_style import View
from web_panel.views.return_map import ReturnMapView
from web_panel.views.roll import RollView
from web_panel.views.spectrum import SpectrumView
from web_panel.views.theory_client import TheoryClient

Make = Callable[[viser.GuiApi, float], View]
_NOTHING = "Nothing"
_ALWAYS = frozenset({STRIKES})  # the page tells the last one
_HIDDEN_PX = 8  # as wide a picture is where the style hides it: one pixel of the page, some of a screen


class Sources(NamedTuple):
    """Sources of the views besides the rig."""

    computer: Computer
    accuracy: Files


class Looking:
    """One browser's choice."""

    def __init__(
        self, client: viser.ClientHandle, messages: ClientMessages, kinds: dict[str, Make], order: float
    ) -> None:
        self._client, self._messages, self._kinds, self._order = client, messages, kinds, order
        self._gui = client.gui
        names = (*kinds, _NOTHING)
        self._chosen, self._shown = names[0], ""
        self._view: View | None = None
        self._mark = self._gui.add_html(markup.chosen(self._chosen), order=order - 0.1)
        self._buttons = self._gui.add_button_group("View", names, order=order)
        self._title = self._gui.add_html("", order=order + 0.1)
        self._id = control_id(self._buttons)
        messages.controls[self._id] = lambda value: value in names
        self._buttons.on_click(self._choose)

    async def _choose(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        self._chosen = event.target.value

    @property
    def needs(self) -> frozenset[str]:
        """Subscriptions needed for this view: the picture, too, where there is room for one."""
        has_picture = self._client.camera.image_width > _HIDDEN_PX
        needs = _ALWAYS | {MEMBRANE} if has_picture else _ALWAYS
        return needs if self._view is None else needs | self._view.needs

    def show(self, rig_state: RigState, history: PlotHistory, now: float) -> None:
        """Make the view that was chosen, and bring it up to date."""
        if self._chosen != self._shown:
            self._shown = self._chosen
            self._mark.content = markup.chosen(self._shown)
            if self._view is not None:
                self._view.remove()
            make = self._kinds.get(self._shown)
            self._view = make(self._gui, self._order + 0.2) if make is not None else None
            self._title.content = markup.line("" if make is None else self._shown, "view")
        if self._view is not None:
            self._view.show(rig_state, history, now)

    def forget(self) -> None:
        """The browser has gone, and its controls with it."""
        self._messages.controls.pop(self._id, None)


class Views:
    """Views of all browsers."""

    def __init__(
        self, server: viser.ViserServer, messages: ClientMessages, sources: Sources, order: float
    ) -> None:
        # A browser may leave between two looks at who is there.
        warnings.filterwarnings("ignore", message="Queued a .* on a closed connection")
        self._server, self._messages, self._order = server, messages, order
        self._history = PlotHistory()
        self._looking: dict[int, Looking] = {}
        theorist = TheoryClient(sources.computer)
        self._kinds: dict[str, Make] = {
            "Roll": RollView,
            "Level": LevelView,
            "Orbit": lambda gui, at: PhasePlaneView(gui, at, theorist),
            "Return map": lambda gui, at: ReturnMapView(gui, at, theorist),
            "Spectrum": SpectrumView,
            "Cost": lambda gui, at: CostView(gui, at, theorist),
            "Accuracy": lambda gui, at: AccuracyView(gui, at, sources.accuracy),
            "Health": lambda gui, at: HealthView(gui, at, lambda: len(self._looking)),
        }

    @property
    def needs(self) -> frozenset[str]:
        """Subscriptions needed for everything that is shown."""
        return frozenset[str]().union(*(looking.needs for looking in self._looking.values()))

    def follow(self) -> bool:
        """Note which browsers came and went; True while there is one."""
        clients = self._server.get_clients()
        for gone in self._looking.keys() - clients.keys():
            self._looking.pop(gone).forget()
        for came in clients.keys() - self._looking.keys():
            self._looking[came] = Looking(clients[came], self._messages, self._kinds, self._order)
        return bool(self._looking)

    def take(self, rig_state: RigState, now: float) -> None:
        """Note what is new, for the plots."""
        self._history.take(rig_state, now)

    def show(self, rig_state: RigState, now: float) -> None:
        """Bring every browser's view up to date."""
        for looking in self._looking.values():
            looking.show(rig_state, self._history, now)
