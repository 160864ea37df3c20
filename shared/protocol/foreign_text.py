"""Text that somebody else chose, as a terminal, a log and a page may have it: keys, names, addresses, reasons.

Any thread.
"""

_CUT = "..."


def shown(text: object, most: int = 120) -> str:
    r"""`text` on one line of at most `most` characters, without what steers a terminal: ESC becomes \x1b.

    A backslash is doubled, so that nobody can feign an escape.
    """
    parts: list[str] = []
    room = most
    for letter in str(text):
        part = letter if letter.isprintable() and letter != "\\" else letter.encode("unicode_escape").decode()
        if len(part) > room:
            while parts and room < len(_CUT):
                room += len(parts.pop())
            return "".join(parts) + _CUT
        parts.append(part)
        room -= len(part)
    return "".join(parts)
