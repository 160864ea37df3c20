"""Measurements of this machine, each a program: `drumstick lab` lists them."""
