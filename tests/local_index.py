"""A package index (PEP 503) on loopback, of wheels made again from what this environment has installed."""

import functools
import http.server
import re
import threading
import zipfile
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement


def normal(name: str) -> str:
    """The name as indexes spell it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def needed(requirements: Iterable[str], found: dict[str, metadata.Distribution]) -> None:
    """Add what `requirements` ask for, and what that asks for, without extras."""
    for requirement in map(Requirement, requirements):
        name = normal(requirement.name)
        if name not in found and (requirement.marker is None or requirement.marker.evaluate({"extra": ""})):
            found[name] = metadata.distribution(name)
            needed(found[name].requires or [], found)


def wheel_again(distribution: metadata.Distribution, folder: Path) -> Path:
    """Zip an installed distribution into a wheel, without its scripts, which an installer makes."""
    about = distribution.read_text("WHEEL") or ""
    tags = [line.partition(": ")[2].split("-") for line in about.splitlines() if line.startswith("Tag: ")]
    tag = "-".join(".".join(sorted({each[at] for each in tags})) for at in range(3))
    name = normal(distribution.name).replace("-", "_")
    wheel = folder / f"{name}-{distribution.version}-{tag}.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        for file in distribution.files or []:
            if (
                file.parts[0] != ".."
                and file.suffix != ".pyc"
                and file.name not in ("INSTALLER", "REQUESTED")
            ):
                archive.write(str(file.locate()), str(file))
    return wheel


@contextmanager
def served(wheels: Iterable[Path], folder: Path) -> Generator[str]:
    """An index of `wheels`, as a project's page links them; its address."""
    for wheel in wheels:
        place = folder / "simple" / normal(wheel.name.partition("-")[0])
        place.mkdir(parents=True)
        (place / wheel.name).symlink_to(wheel)
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=str(folder))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}/simple/"
        finally:
            server.shutdown()
            thread.join()
