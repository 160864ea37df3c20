"""Plants that the tick itself moves: a simulated arm, the hands that hold it, and recordings that are played."""
