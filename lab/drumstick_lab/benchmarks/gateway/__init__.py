"""Cost of the gateway and delay of a strike in it: how it waits for the servo."""
