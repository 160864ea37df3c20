"""Measuring tools for the mesh, the excitation and the drum's effects."""
