"""Effects of each scene: what it compiles, holds, sends and shows, and nothing else."""
