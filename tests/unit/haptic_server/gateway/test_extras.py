"""OSCQuery and MIDI are absent unless asked for: not even their packages are imported."""

import subprocess
import sys

EXTRA_PACKAGES = ("asyncio", "websockets", "zeroconf", "ifaddr", "rtmidi2")


def test_a_gateway_that_is_not_asked_for_extras_imports_nothing_of_them() -> None:
    look = (
        "import argparse, sys\n"
        "import haptic_server.gateway.process\n"
        "from haptic_server.gateway import options\n"
        "from haptic_server.gateway.extras import Extras\n"
        "sys.argv = ['gateway', '--run-dir', '.', '--state-dir', '.']\n"
        "extras = Extras(options.read())\n"
        "extras.close()\n"
        f"print(sorted(set(sys.modules) & set({EXTRA_PACKAGES!r})), extras.targets, extras.counters())\n"
    )
    done = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[] [] {}"
