"""The controls of one scene: the two that matter most first and large, the rest folded away."""

import viser

from drumstick.parameters.scene import Scene
from drumstick.scenes.table import Parameter, values_of
from drumstick.stick.law import law_of
from web_panel.access.client_message import ClientMessages
from web_panel.controls.control import Control
from web_panel.controls.exact_entry import ExactEntry
from web_panel.rig.rig_state import RigState
from web_panel.tuning.changes import Changes

FIRST = ("dv_pls", "k_coll")


class Tuning:
    """Made anew for each scene, in the same places on the page. Main thread."""

    def __init__(
        self,
        server: viser.ViserServer,
        messages: ClientMessages,
        changes: Changes,
        scene: Scene,
        table: dict[str, Parameter],
        order: float,
        order_of_more: float,
    ) -> None:
        values = values_of(law_of(scene), table)
        self._first = server.gui.add_folder(None, order=order)
        self._more = server.gui.add_folder("More", order=order_of_more, expand_by_default=False)
        self.controls: dict[str, Control] = {}
        for name in sorted(table, key=lambda name: FIRST.index(name) if name in FIRST else len(FIRST)):
            large = name in FIRST
            folder = self._first if large else self._more
            self.controls[name] = Control(server, folder, messages, changes, table[name], values[name], large)
        self._exact = ExactEntry(server, self._more, messages, changes, table)

    def remove(self) -> None:
        """Take the controls off the page."""
        for control in self.controls.values():
            control.forget()
        self._exact.forget()
        self._first.remove()
        self._more.remove()

    def show(self, rig_state: RigState, accepted: dict[str, tuple[float, float]]) -> None:
        """Write what changed to the page. `accepted`: of a parameter that the envelope bounds, its lowest and highest
        value.
        """
        revision = rig_state.newest_revision()
        for name, control in self.controls.items():
            control.show(
                rig_state.readbacks.get(name), rig_state.setpoints.get(name), revision, accepted.get(name)
            )
