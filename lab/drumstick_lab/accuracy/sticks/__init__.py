"""Measuring tools for the stick and the servo."""
