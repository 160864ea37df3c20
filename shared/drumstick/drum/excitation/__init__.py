"""Excitations of the head: analytic pulses of strikes, streamed forces, and mallets."""
