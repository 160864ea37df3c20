"""Effects of the stick, one file each. A scene that does not name an effect carries none of its code or memory."""
