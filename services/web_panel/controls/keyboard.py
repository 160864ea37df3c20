"""Keys of the keyboard, for the whole page. viser passes over them while somebody types in a field."""

from collections.abc import Awaitable, Callable
from typing import Any

import viser

from web_panel.access.client_message import ClientMessages
from web_panel.access.viser_access import key_id


def add_key(
    server: viser.ViserServer,
    messages: ClientMessages,
    label: str,
    words: str,
    key: Any,
    modifier: Any,
    act: Callable[[int | None], Awaitable[None] | None],
) -> None:
    """Let a key do what a control does; viser also lists it in the palette that opens by Ctrl+K.

    `act` gets the browser's id, on viser's event loop, and must not block. `key` and `modifier` as viser spells them.
    """
    command = server.gui.add_command(label, description=words, hotkey=key, modifier=modifier)

    async def pressed(event: viser.CommandEvent) -> None:
        done = act(event.client_id)
        if done is not None:
            await done

    command.on_trigger(pressed)
    messages.keys.add(key_id(command))
