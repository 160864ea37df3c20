"""What compiled code on real-time threads needs: the compiler's door, atomic cells, ring, triple buffer, clock.

Nothing here knows drums. Services and `drumstick` build on it; it imports nothing of ours.
"""
