"""Writes docs/security.md; the table of roles is made from the code: drumstick lab security-page.

The words are in security.template.md.
"""

from pathlib import Path

from drumstick_lab.checkout import DOCS
from protocol.access.roles import ROLES
from rig.identity.rig_template import PUBLIC_PORT

PAGE = DOCS / "security.md"
TEMPLATE = Path(__file__).parent / "security.template.md"


def _keys(names: tuple[str, ...]) -> str:
    return ", ".join(f"`{name}`" for name in names) or "-"


def _roles() -> str:
    rows = [
        "| role | for | hears | asks | puts | is seen as | sees |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, role in ROLES.items():
        tails = (role.subscribes, role.asks, role.publishes, role.is_seen_as, role.sees)
        rows.append(f"| `{name}` | {role.words} | {' | '.join(_keys(t) for t in tails)} |")
    return "\n".join(rows)


def page() -> str:
    """The whole page."""
    words = TEMPLATE.read_text(encoding="utf-8")
    return words.replace("{roles}", _roles()).replace("{port}", str(PUBLIC_PORT))


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
