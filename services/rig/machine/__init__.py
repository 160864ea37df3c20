"""Checks of this machine: doctor, real time, needs."""
