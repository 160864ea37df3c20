"""Measuring a rendered drum: its cost, its pitch, its modes."""
