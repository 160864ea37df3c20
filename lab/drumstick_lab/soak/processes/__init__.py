"""The soak in real time: the whole rig as processes, and who plays, watches and visits it."""
