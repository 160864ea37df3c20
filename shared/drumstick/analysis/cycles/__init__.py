"""Cycles of the stick: returns, the return map, fixed points and multipliers, settling and sweeps."""
