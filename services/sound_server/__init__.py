"""The drum that is heard: struck over the network, mixed to an audio device, a file or nowhere.

`python -m sound_server` is the process; the drum itself is `drumstick.drum`, which also renders offline.
"""
