"""Thresholds of ear and hand."""
