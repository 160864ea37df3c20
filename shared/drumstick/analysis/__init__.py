"""Analysis of a scene: what the paper predicts, what the exact motion does, one noun per file."""
