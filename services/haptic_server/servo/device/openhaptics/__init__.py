"""A SensAble, Geomagic or 3D Systems PHANTOM through the vendor's OpenHaptics library, its HD layer only.

No C extension: the library is bound with ctypes, and the servo callback is compiled by numba and calls it by address.
"""
