"""Threads that compute one drum together."""
