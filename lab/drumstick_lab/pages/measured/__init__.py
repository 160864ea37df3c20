"""The pages that are made of stored results."""
