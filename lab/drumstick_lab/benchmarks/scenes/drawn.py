"""Parts of the page that the panel makes for a scene, as a visitor's browser gets them; no browser draws them."""

import re
import time
from collections.abc import Mapping
from typing import Any, NamedTuple

from panel_wire import Visitor, dial_port

from web_panel.access.client_message import CAMERA_AT_FIRST

STILL_S, PATIENCE_S = 2.0, 60.0
# What a visitor looks at and cannot move.
_LOOKED_AT = {"GuiFolderMessage", "GuiHtmlMessage", "GuiUplotMessage"}
_UNSEEN_NODES = {"FrameMessage", "DirectionalLightMessage", "AmbientLightMessage"}
_PARAMETER = re.compile(r'data-param="([^"]+)"')


class Drawn(NamedTuple):
    """Parts in view, every folder open: names at controls of values, and numbers of controls, plots and parts in 3-D."""

    values: list[str]
    controls: int
    plots: int
    nodes: int


def drawn_of(
    parts: Mapping[str, dict[str, Any]], updates: list[dict[str, Any]], nodes: Mapping[str, str]
) -> Drawn:
    """The parts that a visitor was told of, with what changed of them since."""
    props = {uuid: dict(part["props"]) for uuid, part in parts.items() if "container_uuid" in part}
    for update in updates:
        if update["uuid"] in props:
            props[update["uuid"]] |= update["updates"]

    def in_view(uuid: str) -> bool:
        return uuid not in props or (
            props[uuid].get("visible", True) and in_view(parts[uuid]["container_uuid"])
        )

    kinds = {uuid: parts[uuid]["type"] for uuid in props if in_view(uuid)}
    texts = "".join(str(props[uuid].get("content", "")) for uuid in kinds)
    return Drawn(
        sorted(set(_PARAMETER.findall(texts))),
        sum(kind not in _LOOKED_AT for kind in kinds.values()),
        sum(kind == "GuiUplotMessage" for kind in kinds.values()),
        sum(kind not in _UNSEEN_NODES for kind in nodes.values()),
    )


def drawn_on(port: int, cookie: str, still_s: float = STILL_S) -> Drawn:
    """Parts of a panel's page for a visitor who has just come, once none was added or hidden for so long.

    Raises TimeoutError when it does not come to rest.
    """
    with dial_port(port, f"http://127.0.0.1:{port}", Cookie=cookie) as wire:
        visitor = Visitor(wire)
        wire.send(CAMERA_AT_FIRST)  # without it viser does not count on a visitor
        found, begun = None, time.monotonic()
        still_since = begun
        while found is None or not found.values or time.monotonic() < still_since + still_s:
            if time.monotonic() > begun + PATIENCE_S:
                raise TimeoutError(f"the page did not come to rest in {PATIENCE_S:g} s: {found}")
            visitor.read()
            newest = drawn_of(visitor.parts, visitor.updates, visitor.nodes)
            if newest != found:
                found, still_since = newest, time.monotonic()
    return found
