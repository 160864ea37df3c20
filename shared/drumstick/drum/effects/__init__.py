"""Effects of a drum besides its head, one file each. A scene that does not name one gets none of its code.

Kernels take the whole engine (drumstick.drum.engine.Engine), for the audio thread: no allocation, no locks.
"""
