"""A study of practice: tasks, a metronome, a log of each player's sessions, and the table of all of them."""
