"""The laboratory: everything that measures the instrument. Nothing of the instrument imports it."""
