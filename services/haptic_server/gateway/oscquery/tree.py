"""The tree of OSC addresses as OSCQuery describes it, made of the table in protocol.osc and of the scene's parameters.

Fixed while a scene plays. Pure; any thread.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from drumstick.scenes.table import Parameter
from protocol import osc

READ, WRITE = 1, 2  # bits of ACCESS; 0 is a container

# What is told of a node besides FULL_PATH, TYPE and CONTENTS, which the proposal requires.
OPTIONAL = ("ACCESS", "VALUE", "RANGE", "DESCRIPTION", "UNIT", "CLIPMODE", "OVERLOADS", "CRITICAL")
ATTRIBUTES = ("FULL_PATH", "TYPE", "CONTENTS", *OPTIONAL)
NOT_OFFERED = ("TAGS", "EXTENDED_TYPE", "HTML")  # what the proposal has besides
# What clients are told when another scene has other addresses.
ADDED, REMOVED, CHANGED = "PATH_ADDED", "PATH_REMOVED", "PATH_CHANGED"
EXTENSIONS = dict.fromkeys((*OPTIONAL, "LISTEN", ADDED, REMOVED, CHANGED), True)

# Units that the proposal has names of its own for; others are told as they are.
_UNITS = {"m": "distance.m", "m/s": "speed.m/s", "s": "time.second", "Hz": "time.hz"}
_ROOT = "The haptic drumstick"


@dataclass
class Node:
    """One address. `fixed`: its attributes but VALUE and CONTENTS; `parameter`, `norm`: whose value in which form."""

    path: str
    access: int = 0
    fixed: dict[str, object] = field(default_factory=dict[str, object])
    parameter: str = ""
    norm: bool = False
    children: dict[str, "Node"] = field(default_factory=dict[str, "Node"])

    def all(self) -> Iterator["Node"]:
        """This node and every one below it."""
        yield self
        for child in self.children.values():
            yield from child.all()

    def find(self, path: str) -> "Node | None":
        """The node at an address below the root; "/" is the root itself."""
        node: Node | None = self
        first, *parts = path.split("/")
        for part in parts if path != "/" else ():
            node = node.children.get(part) if node is not None else None
        return node if first == "" and parts else None

    def describe(self, value_of: Callable[["Node"], list[osc.Argument] | None]) -> dict[str, object]:
        """The JSON object of this node and of everything below it."""
        described = dict(self.fixed)
        value = value_of(self) if self.access & READ else None
        if value is not None:
            described["VALUE"] = value
        if self.children:
            described["CONTENTS"] = {name: child.describe(value_of) for name, child in self.children.items()}
        return described


def unit_name(unit: str) -> str | None:
    """Name of an SI unit in the OSCQuery proposal; None for a number without one."""
    return _UNITS.get(unit, unit) if unit not in ("", "1") else None


def _limits(limits: tuple[float, float] | None) -> dict[str, float] | None:
    return None if limits is None else {"MIN": limits[0], "MAX": limits[1]}


def _of_sent(row: osc.Sent, parameter: Parameter | None) -> dict[str, object]:
    ranges, units = row.ranges, row.units
    if parameter is not None and row is osc.PARAM:
        quantity = parameter.quantity
        ranges, units = ((quantity.low, quantity.high),), (quantity.unit,)
    described: dict[str, object] = {"TYPE": row.types}
    if ranges:
        described["RANGE"] = [_limits(each) for each in ranges]
    if any(unit_name(unit) for unit in units):
        described["UNIT"] = [unit_name(unit) for unit in units]
    return described


def _words(row: osc.Sent | osc.Incoming, parameter: Parameter | None) -> str:
    return row.words if parameter is None else f"{parameter.quantity.words}; {row.words}"


def _add(root: Node, prefix: str, row: osc.Sent | osc.Incoming, parameter: Parameter | None) -> Node:
    path = osc.address(prefix, row, parameter.name if parameter is not None else "")
    node = root
    for part in path.split("/")[1:]:
        here = f"{node.path.rstrip('/')}/{part}"
        node = node.children.setdefault(part, Node(here, fixed={"FULL_PATH": here, "ACCESS": 0}))
    if parameter is not None:
        node.parameter, node.norm = parameter.name, path.endswith("/norm")
    return node


def _add_sent(root: Node, prefix: str, row: osc.Sent, parameter: Parameter | None) -> None:
    node = _add(root, prefix, row, parameter)
    node.fixed["DESCRIPTION"] = _words(row, parameter)
    if row is osc.PONG:
        return  # an answer to whoever asked: there is no value to be read, and nothing to be listened to
    node.access |= READ
    node.fixed |= _of_sent(row, parameter)


def _add_heard(root: Node, prefix: str, row: osc.Incoming, parameter: Parameter | None) -> None:
    node = _add(root, prefix, row, parameter)
    forms = ["" if form == "any" else form for form in row.forms]
    read_as = node.fixed.get("TYPE")
    if read_as is None:
        node.fixed |= {"TYPE": forms[0], "DESCRIPTION": _words(row, parameter)}
    elif read_as in forms:
        node.fixed["DESCRIPTION"] = _words(row, parameter)
    if read_as is None or read_as in forms:
        node.access |= WRITE
        if "RANGE" in node.fixed:
            node.fixed["CLIPMODE"] = ["none"]  # what lies outside is refused
    others = [form for form in forms if form and form != node.fixed["TYPE"]]
    if others:
        node.fixed["OVERLOADS"] = [
            {"TYPE": form, "ACCESS": WRITE, "DESCRIPTION": _words(row, parameter)} for form in others
        ]
    if row is osc.PANIC:
        node.fixed["CRITICAL"] = True


def _named(row: osc.Sent | osc.Incoming, table: Mapping[str, Parameter]) -> Iterable[Parameter | None]:
    return table.values() if "NAME" in row.path else (None,)


def tree_of(prefix: str, table: Mapping[str, Parameter]) -> Node:
    """The root of everything that is sent and heard behind `prefix` in a scene with these parameters."""
    root = Node("/", fixed={"FULL_PATH": "/", "ACCESS": 0, "DESCRIPTION": _ROOT})
    for sent in osc.SENT:
        for parameter in _named(sent, table):
            _add_sent(root, prefix, sent, parameter)
    for heard in osc.INCOMING:
        for parameter in _named(heard, table):
            _add_heard(root, prefix, heard, parameter)
    for node in root.all():
        node.fixed["ACCESS"] = node.access
    return root


def changes(before: Node, after: Node) -> Iterator[tuple[str, str]]:
    """The steps that make one tree of the other, node by node: REMOVED, CHANGED or ADDED, and an address. Of what is
    removed or added as a whole, the uppermost address alone.
    """
    if before.fixed != after.fixed:
        yield CHANGED, after.path
    for name, child in before.children.items():
        if name in after.children:
            yield from changes(child, after.children[name])
        else:
            yield REMOVED, child.path
    for name, child in after.children.items():
        if name not in before.children:
            yield ADDED, child.path
