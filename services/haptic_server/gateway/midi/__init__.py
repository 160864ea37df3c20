"""Strikes as MIDI notes. Off unless asked for; the library runs in a process of its own."""
