"""Rate and level of the roll: asked for by any way, found by a process of its own, set step by step."""
