"""Access to the page, and checks of all that a browser sends."""
