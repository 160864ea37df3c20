"""The struck membrane: where its junctions lie, how a step is taken, how fast it may go."""
