"""The page and its parts: markup, style, words, scripts, the picture of the drum."""
