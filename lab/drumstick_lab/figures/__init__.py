"""Figures that only the laboratory draws."""
