"""The moments at which an effect may act: the argument `when` of `composition.fire`."""

ON_ENTRY, ON_TURN, ON_EXIT = 0, 1, 2  # z = 0 going down; the first deepest point of a contact; z = 0 going up
ON_RISE, ON_DESCENT = 3, 4  # in the head, the stick begins to move up, or down again
