"""Destinations of the sound: an audio device, a WAV file, or nowhere. All render with the same compiled block."""
