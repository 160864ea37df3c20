"""The devices that a servo can move: a simulated arm, and a PHANTOM. `protocol` says what they have in common."""
