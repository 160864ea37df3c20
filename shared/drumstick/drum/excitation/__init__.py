"""What excites the head: analytic pulses of strikes, and streamed forces."""
