"""Cycles of the stick: laps, the return map, fixed points and multipliers, settling and sweeps."""
