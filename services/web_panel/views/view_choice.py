"""Choice of views for each browser, by a row of buttons: one below the controls, or several beside them.

viser does not tell which folders a browser has open. So each browser has its own choice, and only what it looks at is
asked for, computed and sent. Main thread.
"""

import contextlib
import queue
import warnings
from collections.abc import Callable
from typing import NamedTuple

import viser

from web_panel.access.client_message import ClientMessages
from web_panel.access.viser_access import control_id
from web_panel.accuracy_results import Files
from web_panel.computing.computer import Computer
from web_panel.page import markup
from web_panel.page.browser_window import BrowserWindow
from web_panel.rig.history import PlotHistory
from web_panel.rig.rig_state import RigState
from web_panel.rig.view_subscriptions import MEMBRANE, STRIKES
from web_panel.views.accuracy import AccuracyView
from web_panel.views.cost import CostView
from web_panel.views.health import HealthView
from web_panel.views.level import LevelView
from web_panel.views.phase_plane import PhasePlaneView
from web_panel.views.plot_style import View, csv_of
from web_panel.views.return_map import ReturnMapView
from web_panel.views.roll import RollView
from web_panel.views.spectrum import SpectrumView
from web_panel.views.theory_client import TheoryClient

Make = Callable[[viser.GuiApi, float], View]
Presses = queue.SimpleQueue[tuple[bool, str]]  # was it beside the controls, and which button
PAUSE, EXPORT = "Pause", "Save as CSV"
_NOTHING = "Nothing"
_PLOTS_PX = 600.0  # of the panel with the plots
_ALWAYS = frozenset({STRIKES})  # the page tells the last one


class Sources(NamedTuple):
    """Sources of the views besides the rig."""

    computer: Computer
    accuracy: Files


class Looking:
    """One browser's choice. Main thread."""

    def __init__(
        self, client: viser.ClientHandle, messages: ClientMessages, kinds: dict[str, Make], order: float
    ) -> None:
        self._client, self._messages, self._kinds, self._order = client, messages, kinds, order
        self._window = BrowserWindow(client, messages, order - 0.4)
        self._pressed: Presses = queue.SimpleQueue()
        self._chosen: tuple[str, ...] = (next(iter(kinds)),)
        self._paused = False
        self._shown: dict[str, tuple[viser.GuiHtmlHandle, View]] = {}
        self._is_wide = False
        self._place = _Place(client, False, (*kinds, _NOTHING), self._pressed, messages, order)

    @property
    def needs(self) -> frozenset[str]:
        """Subscriptions needed for these views: the picture, too, where there is room for one."""
        needs = _ALWAYS | {MEMBRANE} if self._window.has_picture else _ALWAYS
        return needs.union(*(view.needs for _, view in self._shown.values()))

    def show(self, rig_state: RigState, history: PlotHistory, now: float) -> None:
        """Make the views that were chosen where the window has room for them, and bring them up to date."""
        self._window.follow(None if rig_state.scene is None else rig_state.scene.drum.radius_m)
        if self._window.is_wide != self._is_wide:
            self._is_wide = self._window.is_wide
            self._move()
        while not self._pressed.empty():
            self._obey(*self._pressed.get())
        if not self._is_wide:
            self._chosen = self._chosen[-1:]
        for name in [name for name in self._shown if name not in self._chosen]:
            self._take_off(name)
        for name in self._chosen:
            if name not in self._shown:
                self._put_on(name)
        self._place.mark(self._chosen, self._paused)
        self._window.confirm()  # last: all that it has room for is on its way to the browser
        for _, view in self._shown.values():
            if not self._paused:
                view.show(rig_state, history, now)

    def _obey(self, was_wide: bool, button: str) -> None:
        # Whatever window there is by now: a button means what it meant where it was pressed.
        if button == PAUSE:
            self._paused = not self._paused
        elif button == EXPORT:
            self._export()
        elif button == _NOTHING:
            self._chosen = ()
        elif not was_wide:
            self._chosen = (button,)
        elif button in self._chosen:
            self._chosen = tuple(name for name in self._chosen if name != button)
        else:
            self._chosen = (*self._chosen, button)

    def _export(self) -> None:
        for name, (_, view) in self._shown.items():
            for number, plot in enumerate(view.plots, start=1):
                file = f"{name.lower().replace(' ', '-')}-{number}.csv"
                self._client.send_file_download(file, csv_of(plot), save_immediately=True)

    def _move(self) -> None:
        for name in list(self._shown):
            self._take_off(name)
        self._place.remove()
        names = (*self._kinds, _NOTHING)
        self._place = _Place(self._client, self._is_wide, names, self._pressed, self._messages, self._order)

    def _put_on(self, name: str) -> None:
        at = self._order + 1.0 + list(self._kinds).index(name)
        with self._place.inside():
            title = self._client.gui.add_html(markup.line(name, "view"), order=at)
            self._shown[name] = title, self._kinds[name](self._client.gui, at + 0.1)
        self._paused = False  # what was not there yet has nothing to stand still with

    def _take_off(self, name: str) -> None:
        title, view = self._shown.pop(name)
        title.remove()
        view.remove()

    def forget(self) -> None:
        """The browser has gone, and its controls with it."""
        self._window.forget()
        self._place.forget()


class _Place:
    """Buttons of the views, and where these stand: below the controls, or in a panel of their own at the left.

    Main thread, but for the presses, which come in viser's and are only noted.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        own_panel: bool,
        names: tuple[str, ...],
        pressed: Presses,
        messages: ClientMessages,
        order: float,
    ) -> None:
        self._messages = messages
        self._panel: viser.PanelHandle | None = None
        if own_panel:
            self._panel = client.gui.add_panel()
            self._tab = self._panel.add_tab("Views")
            self._panel.dock_left()
            self._panel.set_width(_PLOTS_PX)
        with self.inside():
            self._chosen = client.gui.add_html("", order=order - 0.1)
            self._views = client.gui.add_button_group("View", names, order=order)
            self._paused = client.gui.add_html("", order=order + 0.1)
            self._plots = client.gui.add_button_group("Plots", (PAUSE, EXPORT), order=order + 0.2)
        messages.controls[control_id(self._views)] = lambda value: value in names
        messages.controls[control_id(self._plots)] = lambda value: value in (PAUSE, EXPORT)

        async def press(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            pressed.put((own_panel, event.target.value))

        self._views.on_click(press)
        self._plots.on_click(press)

    def inside(self) -> contextlib.AbstractContextManager[object]:
        """Whatever is added to the page meanwhile stands here."""
        return contextlib.nullcontext() if self._panel is None else self._tab

    def mark(self, chosen: tuple[str, ...], paused: bool) -> None:
        """Show which buttons are pressed."""
        for mark, names in ((self._chosen, chosen), (self._paused, (PAUSE,) if paused else ())):
            content = markup.chosen(*names)
            if content != mark.content:
                mark.content = content

    def forget(self) -> None:
        """Its buttons are not pressed any more."""
        for buttons in (self._views, self._plots):
            self._messages.controls.pop(control_id(buttons), None)

    def remove(self) -> None:
        """Take it off the page."""
        self.forget()
        for part in (self._chosen, self._views, self._paused, self._plots):
            part.remove()
        if self._panel is not None:
            self._panel.remove()


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
