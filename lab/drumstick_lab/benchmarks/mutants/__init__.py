"""Which wrong programs the tests notice."""
