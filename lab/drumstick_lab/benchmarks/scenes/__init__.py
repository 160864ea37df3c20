"""What each scene calls for, and nothing else."""
