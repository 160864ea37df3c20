"""Mutation testing: wrong programs that the tests notice, or do not."""
