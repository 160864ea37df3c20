"""A reader with a fault that no example meets by chance: by it a test shows that the fuzzer finds what it should."""


def read(data: bytes) -> None:
    """Fails behind four branches."""
    if data[:1] == b"d" and data[1:2] == b"r" and data[2:3] == b"u" and data[3:4] == b"m":
        raise KeyError("planted")
