"""The C side of the HD layer: its types, its one struct, and what each function takes and returns. Any thread."""

import ctypes
import sys
from typing import Any

HHD = ctypes.c_uint32
Enum = ctypes.c_uint32
Boolean = ctypes.c_uint8
Int = ctypes.c_int32
Short = ctypes.c_uint16
Long = ctypes.c_ulong  # 8 bytes on 64-bit Linux and macOS, 4 on Windows, as the C type is
Double = ctypes.c_double
Callback = ctypes.c_void_p  # uint32 f(void *): always compiled code, never a Python function

# Windows: stdcall on 32 bit; on 64 bit there is one convention and both names mean it.
Library: Any = ctypes.WinDLL if sys.platform == "win32" else ctypes.CDLL


class ErrorInfo(ctypes.Structure):
    """Error of the HD layer as hdGetError returns it, by value: 12 bytes."""

    _fields_ = (("code", ctypes.c_uint32), ("internal", ctypes.c_int32), ("device", ctypes.c_uint32))


_P = ctypes.POINTER
# name: (returns, takes)
FUNCTIONS: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "hdInitDevice": (HHD, (ctypes.c_char_p,)),
    "hdDisableDevice": (None, (HHD,)),
    "hdMakeCurrentDevice": (None, (HHD,)),
    "hdBeginFrame": (None, (HHD,)),
    "hdEndFrame": (None, (HHD,)),
    "hdGetBooleanv": (None, (Enum, _P(Boolean))),
    "hdGetIntegerv": (None, (Enum, _P(Int))),
    "hdGetDoublev": (None, (Enum, _P(Double))),
    "hdSetDoublev": (None, (Enum, _P(Double))),
    "hdGetString": (ctypes.c_char_p, (Enum,)),
    "hdEnable": (None, (Enum,)),
    "hdDisable": (None, (Enum,)),
    "hdIsEnabled": (Boolean, (Enum,)),
    "hdStartScheduler": (None, ()),
    "hdStopScheduler": (None, ()),
    "hdSetSchedulerRate": (None, (Long,)),
    "hdScheduleAsynchronous": (Long, (Callback, ctypes.c_void_p, Short)),
    "hdUnschedule": (None, (Long,)),
    "hdGetError": (ErrorInfo, ()),
    "hdGetErrorString": (ctypes.c_char_p, (ctypes.c_uint32,)),
    "hdCheckCalibration": (Enum, ()),
    "hdUpdateCalibration": (None, (Enum,)),
}


def declare(library: Any) -> list[str]:
    """Give every function of the loaded library its types; returns the names that the library lacks."""
    missing: list[str] = []
    for name, (returns, takes) in FUNCTIONS.items():
        try:
            function = getattr(library, name)
        except AttributeError:
            missing.append(name)
            continue
        function.restype = returns
        function.argtypes = takes
    return missing
