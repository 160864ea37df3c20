"""Generators of the made pages under docs/, each a program: `drumstick lab` lists them."""
