"""The result of `drumstick accuracy` that the pages show: drumstick lab accuracy. In full; stores lab/results/accuracy.json.

Beside it how long `drumstick accuracy --quick` takes on this machine, from the start of the command to its figures, the
first time: with an empty folder of compiled kernels (`quick_first_s`), which is the worst that anybody meets.
"""

import os
import subprocess
import sys
import tempfile
import time

from drumstick_lab.accuracy.run import begun, fill
from drumstick_lab.measuring import stored

_QUICK = (
    sys.executable,
    "-c",
    "from rig.cli.command import main; main()",
    "accuracy",
    "--quick",
    "--json",
    "--out",
)


def quick_first_s() -> float:
    """Seconds of `drumstick accuracy --quick` on a machine that has compiled nothing. Raises CalledProcessError."""
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"XDG_CACHE_HOME": folder, "PYTHONPATH": os.pathsep.join(sys.path)}
        begin_s = time.monotonic()
        subprocess.run([*_QUICK, folder], env=environment, stdout=subprocess.DEVNULL, check=True)
        return time.monotonic() - begin_s


def main() -> None:
    """Measure all parts, and store them."""
    found = begun(quick=False)
    fill(found)
    found["machine"]["quick_first_s"] = round(quick_first_s(), 1)
    stored.store("accuracy", found, **found["machine"])


if __name__ == "__main__":
    main()
