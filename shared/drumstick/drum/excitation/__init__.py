"""What excites the head: analytic pulses of strikes, streamed forces, and mallets."""
