"""Load of the wire, its delays and listeners; recordings; starts."""
