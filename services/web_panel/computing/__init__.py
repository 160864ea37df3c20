"""Slow computations, in a process beside the page: compiling holds Python's lock for seconds."""
