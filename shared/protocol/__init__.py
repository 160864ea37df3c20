"""Everything that crosses a wire, and nothing else: messages, keys, addresses, codecs, Zenoh session settings."""
