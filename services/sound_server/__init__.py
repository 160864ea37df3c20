"""The drum that is heard: a waveguide mesh struck over the network, mixed to an audio device, a file or nowhere.

`python -m sound_server` is the process; `drumstick.drum.render.render` computes the same sound offline.
"""
