"""On which line of a scene's text each table and key stands.

tomllib gives no positions, and a mistake without its line is hard to find. The text is one that tomllib has read, so a
statement is a header in brackets or a key up to `=`, and ends at the first line end outside strings and brackets.
"""

import re

_TOKEN = re.compile(
    r'"""(?:\\.|[^\\])*?"{3,5}|\'\'\'.*?\'{3,5}'  # strings of many lines
    r'|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\''  # strings of one line
    r"|\#[^\n]*"
    r"|[\[{]|[\]}]|[=.,\n]"
    r"|[^\s\[\]{}=.,\"'\#]+|[^\S\n]+|.",
    re.DOTALL,
)
_IN_QUOTES = re.compile(r"\\(?:u([0-9a-fA-F]{4})|U([0-9a-fA-F]{8})|(.))", re.DOTALL)


def _plain(part: str) -> str:
    # One part of a key, without its quotes.
    if part[0] == "'":
        return part[1:-1]
    if part[0] != '"':
        return part
    return _IN_QUOTES.sub(lambda m: chr(int(m[1] or m[2], 16)) if m[1] or m[2] else m[3], part[1:-1])


def _path(tokens: list[str]) -> str:
    # Of a header or of a key: its parts, dots between.
    return ".".join(_plain(token) for token in tokens if not token.isspace() and token not in ".[]")


def _statements(text: str) -> list[tuple[int, list[str]]]:
    # The number of its first line, and the tokens of each statement's header or key.
    found: list[tuple[int, list[str]]] = []
    head: list[str] = []
    line, begun, depth, in_value = 1, 1, 0, False
    for token in _TOKEN.findall(text):
        if token == "\n" and depth == 0:
            if head:
                found.append((begun, head))
            head, in_value = [], False
        elif token[0] != "#" and not (not head and token.isspace()):
            if not head:
                begun = line
            in_value = in_value or (token == "=" and head[0] != "[")
            if in_value:
                depth += (token in ("[", "{")) - (token in ("]", "}"))
            if not in_value:
                head.append(token)
        line += token.count("\n")
    if head:
        found.append((begun, head))
    return found


def lines_of(text: str) -> dict[str, int]:
    """`table.key` and `table` -> number of the line on which it first stands, from 1."""
    found: dict[str, int] = {}
    table = ""
    for line, head in _statements(text):
        path = _path(head)
        if head[0] == "[":
            table = path
        else:
            path = f"{table}.{path}" if table else path
        while path:  # a dotted key or header opens the tables before its last part too
            found.setdefault(path, line)
            path = path.rpartition(".")[0]
    return found
