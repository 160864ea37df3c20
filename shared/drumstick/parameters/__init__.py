"""Scenes and their tables: declarations with ranges and units, reading TOML, and what can be set live."""
