"""What the tick itself moves: a simulated arm and the hands that hold it, and recordings that are played."""
