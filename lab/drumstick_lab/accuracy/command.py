"""`drumstick accuracy`: measure, keep, draw, and say what to choose."""

import json
import sys
from importlib.util import find_spec
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from drumstick_lab.accuracy import store
from drumstick_lab.accuracy.choices import choices
from drumstick_lab.accuracy.run import begun, fill
from rig import extras, folder
from rig.exit_status import unavailable
from rig.figures import requirements


def accuracy(quick: bool, as_json: bool, out: Path | None) -> None:
    """The result into `out`, or where the panel looks for it, with its figures. Raises CommandError.

    A quick run beside a full one goes into a folder of its own there.
    """
    if find_spec("scipy") is None:
        unavailable("accuracy needs scipy; install haptic-drumstick[sound]")
    where = folder.accuracy_folder() if out is None else out
    if quick and store.is_full(where):
        where /= "quick"
    requirements.require_folder(where)
    found = begun(quick)
    try:
        fill(found)
    except BaseException:  # Ctrl-C too: minutes of measuring are not thrown away
        store.keep(found, where, store.UNFINISHED)
        print(f"not finished; what was measured lies in {where / store.UNFINISHED}", file=sys.stderr)
        raise
    store.keep(found, where)
    (where / store.UNFINISHED).unlink(missing_ok=True)
    written = [store.FILE]
    if line := extras.what_to_type("figures"):
        print(f"no figures: they need matplotlib; type: {line}", file=sys.stderr)
    else:
        from drumstick_lab.accuracy.figures import write

        written += write(found, where)
    if as_json:
        print(json.dumps(found, allow_nan=False))
        return
    table = Table("if you want", "choose", "it costs", box=None, header_style="bold", pad_edge=False)
    for choice in choices(found):
        table.add_row(*(escape(words.replace("`", "")) for words in choice))
    Console().print(table)
    print(f"\nwritten to {where}: {', '.join(written)}")
