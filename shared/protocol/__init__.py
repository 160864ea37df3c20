"""What crosses a wire, and nothing else: messages, keys, addresses, codecs, and how a Zenoh session is configured."""
