"""What an ear or a hand can tell apart."""
