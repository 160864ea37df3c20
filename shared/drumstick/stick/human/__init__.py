"""A hand that is no machine: strikes of a roll that vary in time and level, by seeded random numbers."""
