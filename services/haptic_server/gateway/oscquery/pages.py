"""One HTTP question, one JSON answer, as the OSCQuery proposal has it. Pure but for the values it looks up.

`/ADDRESS` tells a node and all below it, `/ADDRESS?ATTRIBUTE` one attribute, `?HOST_INFO` where OSC and WebSocket are.
An attribute that a node does not have is an empty object; VALUE of what cannot be read is 204, as is an attribute of
the proposal that is not offered; an unknown one is 400, an unknown address 404.
"""

import json
from collections.abc import Mapping
from http import HTTPStatus
from typing import NamedTuple
from urllib.parse import unquote_to_bytes

from haptic_server.gateway.oscquery.tree import ATTRIBUTES, NOT_OFFERED, READ, Node
from haptic_server.gateway.oscquery.values import Snapshot

MAX_QUESTION = 1024  # characters of path and query
HOST_INFO = "HOST_INFO"


class Page(NamedTuple):
    """A status, and JSON when it is OK, else words."""

    status: HTTPStatus
    body: str = ""


def _split(target: str) -> tuple[str, str] | None:
    # Path and query, decoded; None when they cannot be.
    path, _, query = target.partition("#")[0].partition("?")
    try:
        decoded = unquote_to_bytes(path).decode("utf-8"), unquote_to_bytes(query).decode("utf-8")
    except ValueError:
        return None
    return decoded if decoded[0].startswith("/") else None


def page(root: Node, look: Snapshot, target: str, host_info: Mapping[str, object]) -> Page:
    """The answer to GET `target`."""
    if len(target) > MAX_QUESTION:
        return Page(HTTPStatus.REQUEST_URI_TOO_LONG, f"Ask with at most {MAX_QUESTION} characters.")
    asked = _split(target)
    if asked is None:
        return Page(HTTPStatus.BAD_REQUEST, "The address is no UTF-8, or does not start with /.")
    path, attribute = asked
    if attribute == HOST_INFO:
        return _json(host_info)
    if attribute in NOT_OFFERED:
        return Page(HTTPStatus.NO_CONTENT)
    if attribute and attribute not in ATTRIBUTES:
        return Page(HTTPStatus.BAD_REQUEST, f"Ask for one of {', '.join(ATTRIBUTES)} or {HOST_INFO}.")
    node = root.find(path.rstrip("/") or "/")
    if node is None:
        return Page(HTTPStatus.NOT_FOUND, "No such address; ask for / to see all.")
    return _attribute(node, attribute, look) if attribute else _json(node.describe(look.of))


def _attribute(node: Node, attribute: str, look: Snapshot) -> Page:
    if attribute == "VALUE":
        if not node.access & READ:
            return Page(HTTPStatus.NO_CONTENT)
        value = look.of(node)
        return _json({} if value is None else {"VALUE": value})
    if attribute == "CONTENTS":
        described = node.describe(look.of)
        return _json({"CONTENTS": described["CONTENTS"]} if node.children else {})
    return _json({attribute: node.fixed[attribute]} if attribute in node.fixed else {})


def _json(described: Mapping[str, object]) -> Page:
    return Page(HTTPStatus.OK, json.dumps(described, allow_nan=False))
