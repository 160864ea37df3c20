"""The soak in virtual time: gateway and listeners in one process, around the ticks."""
