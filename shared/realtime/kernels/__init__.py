"""The compiler behind one typed module, the store of its kernels, and calls to and from C that numba cannot make."""
