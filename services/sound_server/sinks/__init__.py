"""Where the sound goes: an audio device, a WAV file, or nowhere. All render with the same compiled block."""
