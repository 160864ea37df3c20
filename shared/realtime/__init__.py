"""Tools of compiled real-time code: access to the compiler, atomic cells, ring, triple buffer, clock.

Nothing here knows drums. Services and `drumstick` build on it; it imports nothing of ours.
"""
