"""Figures of a sound: its modes and its spectrogram."""
