"""Names of the sound server's own JACK ports, by what leaves there: PortAudio calls them out_0, out_1 ...

libjack is there wherever PortAudio speaks to a JACK server. Main thread.
"""

import ctypes
import ctypes.util
import logging
from collections.abc import Sequence

_NO_START_SERVER = 0x01  # JackNoStartServer


def name_ports(portaudio: ctypes.CDLL, names: Sequence[str]) -> None:
    """Rename this process's output ports, the first as the first of `names`; says so where that cannot be."""
    client = ctypes.c_char_p()
    try:
        portaudio.PaJack_GetClientName(ctypes.byref(client))
        jack = ctypes.CDLL(ctypes.util.find_library("jack") or "libjack.so.0")
        failed = _renamed(jack, client.value or b"PortAudio", names)
    except (AttributeError, OSError) as error:
        failed = str(error)
    if failed:
        logging.warning("JACK's ports keep the names that PortAudio gave them: %s", failed)


def _renamed(jack: ctypes.CDLL, client: bytes, names: Sequence[str]) -> str:
    # Returns why not, or nothing. A client of our own: PortAudio gives its away to nobody.
    jack.jack_client_open.restype = jack.jack_port_by_name.restype = ctypes.c_void_p
    opened = ctypes.c_void_p(jack.jack_client_open(b"drumstick-names", _NO_START_SERVER, None))
    if not opened:
        return "the JACK server takes no other client"
    try:
        for number, name in enumerate(names):
            own = client + b":out_%d" % number
            port = ctypes.c_void_p(jack.jack_port_by_name(opened, own))
            if not port or jack.jack_port_rename(opened, port, name.encode()) != 0:
                return f"{own.decode()} cannot be renamed"
    finally:
        jack.jack_client_close(opened)
    return ""
