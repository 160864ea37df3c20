"""The commands of a study: whether practice on the instrument carries over to a drum."""

from pathlib import Path
from typing import Annotated

import typer

from rig.options import Connect, RigNameOrFile

_FOLDER = "Folder of the study: a subfolder for each player, which others may not read."


def study_run(
    player: Annotated[
        str, typer.Option(help="Pseudonym: one to three letters and a number, e.g. p07. No names.")
    ],
    task: Annotated[Path, typer.Option(help="The task, a TOML file (docs/study.md).")],
    session: Annotated[
        int | None,
        typer.Option(help="Number of the session; the one that was left off, or the next one, if not given."),
    ] = None,
    folder: Annotated[Path, typer.Option(help=_FOLDER)] = Path("study"),
    rig: RigNameOrFile = None,
    connect: Connect = None,
) -> None:
    """Run one session of one player. Beside a rig that plays; Ctrl-C stops it, the same command goes on."""
    from rig.network.remote_rig import remote_rig
    from rig.study import commands

    commands.run(remote_rig(None, rig, connect), player, session, task, folder)


def study_export(
    folder: Annotated[Path, typer.Argument(help=_FOLDER)],
    out: Annotated[
        Path, typer.Option(help="CSV file with a row a strike; NAME-blocks.csv beside it has the measures.")
    ],
) -> None:
    """Write all sessions as two CSV files. One has a row a strike, one a row for each block."""
    from rig.study import commands

    commands.export(folder, out)


def study_forget(
    folder: Annotated[Path, typer.Argument(help=_FOLDER)],
    player: Annotated[str, typer.Argument(help="Pseudonym of the player.")],
) -> None:
    """Delete one player's sessions."""
    from rig.study import commands

    commands.forget(folder, player)
