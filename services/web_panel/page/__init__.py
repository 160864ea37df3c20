"""Parts of the page: markup, style, words, scripts, the picture of the drum."""
