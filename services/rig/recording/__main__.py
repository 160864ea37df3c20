"""python -m rig.recording: the service of `drumstick up --record`. Status 3: the disk took no more."""

import logging
from itertools import chain
from pathlib import Path

from protocol.keys import Keys
from realtime.log import end_process, open_log
from realtime.service_options import options_of_process
from rig.exit_status import CommandError, unavailable
from rig.network.remote_rig import RemoteRig
from rig.recording.options import RecordingOptions
from rig.recording.record import recorded, words

_log = logging.getLogger("record")
_MAX_PARTS = 10_000


def _free(out: Path) -> Path:
    # After this service was killed and started again: the recording goes on in a file beside the first one.
    parts = (out.with_name(f"{out.stem}-{part}{out.suffix}") for part in range(2, _MAX_PARTS))
    found = next((path for path in chain([out], parts) if not path.exists()), None)
    if found is None:
        unavailable(f"{out}: {_MAX_PARTS} parts are there already: move them away")
    return found


def _warn(what: str) -> None:
    _log.warning("record: %s", what)


def main() -> int:
    """Record until SIGTERM."""
    given = options_of_process(RecordingOptions, "rig.recording")
    end = RemoteRig(given.connect, Keys(given.rig), given.identity)
    open_log()
    try:
        out = _free(given.out)
        _log.info("recording into %s", out)
        result = recorded(end, out, force=given.force, wait=True, say=_warn)
    except CommandError as stop:
        _log.error("%s", stop)
        return stop.status
    _log.info("%s", words(result))
    return 0


if __name__ == "__main__":
    end_process(main())
