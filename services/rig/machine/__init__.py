"""Checks of this machine: doctor, real time, ports, the last fault."""
