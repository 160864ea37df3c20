"""Figures of the stick: what the analysis finds, drawn. One file per figure; a scene goes in, a Figure comes out.

They need matplotlib (the extra `figures`), which only the commands that draw import.
"""
