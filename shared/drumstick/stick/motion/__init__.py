"""Motion of the stick: segments in closed form, events found by root isolation, exact and stepped advance."""
