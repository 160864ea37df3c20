"""The moments at which an effect may act: the argument `when` of `composition.fire`."""

ENTRY, TURN, EXIT = 0, 1, 2  # z = 0 going down; the first deepest point of a contact; z = 0 going up
RISE, SINK = 3, 4  # in the head, the stick begins to move up, or down again
