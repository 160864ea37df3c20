"""Ways to carry the stick along one segment: the closed form, and four steppers to compare it with, one file each."""
