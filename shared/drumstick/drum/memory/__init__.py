"""Memory of a drum's parts, as compiled code has it: records and named tuples of arrays, without what acts on them."""
