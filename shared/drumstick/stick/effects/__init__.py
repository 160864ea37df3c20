"""Effects of the stick, one file each. A scene that does not name one has none of its code or memory."""
