"""Stored results: where they are kept, on which machine and of which version they were made, and who makes them."""
