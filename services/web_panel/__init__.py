"""The technician's page: tune the drumstick from a browser while the ensemble plays.

A process of its own. It never touches force: what it asks, the haptic server accepts or refuses, and what it shows is
what the servo uses. Threads: the main thread reads Zenoh and writes the page; viser's thread serves browsers; one
thread asks for changes.
"""
