"""Declaring numbers, with ranges and units; tables of a scene that are no effect's, and the scene that holds all."""
