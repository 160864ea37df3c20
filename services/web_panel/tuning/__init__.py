"""Changes of parameters: the queue of sets, undo, compare, prediction, panic."""
