"""Generators of the ready files for DAWs and patching programs."""
