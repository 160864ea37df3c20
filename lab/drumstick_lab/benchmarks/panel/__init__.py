"""Cost and delay of the technician's page, and the effect of an attack on it."""
