"""Drums beside recorded ones: by measures, by search and by ear."""
