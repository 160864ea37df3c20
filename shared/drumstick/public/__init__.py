"""The public face of the library: runs of the stick and sounds of the drum, to look at, listen to and compute with."""
