"""Other programs' meshes, as distributions package them: what they cost a sample, and how true their modes are."""
