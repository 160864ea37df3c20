"""OSCQuery and MIDI are absent unless asked for: not even their packages are imported."""

import subprocess
import sys

EXTRA_PACKAGES = ("asyncio", "websockets", "zeroconf", "ifaddr", "rtmidi2")


def test_a_gateway_that_is_not_asked_for_extras_imports_nothing_of_them() -> None:
    look = (
        "import sys\n"
        "from pathlib import Path\n"
        "import haptic_server.gateway.process\n"
        "from haptic_server.gateway.options import GatewayOptions\n"
        "from haptic_server.gateway.extras import Extras\n"
        "extras = Extras(GatewayOptions(run_dir=Path(), state_dir=Path()))\n"
        "extras.close()\n"
        f"print(sorted(set(sys.modules) & set({EXTRA_PACKAGES!r})), extras.targets, extras.counters())\n"
    )
    done = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[] [] {}"
