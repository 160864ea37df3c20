"""Recordings: what a rig does, as an MCAP file. Needs nothing of the services: they meet on the wire."""
