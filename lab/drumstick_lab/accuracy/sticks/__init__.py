"""What the parts about the stick and the servo measure with."""
