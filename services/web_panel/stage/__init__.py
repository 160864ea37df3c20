"""The page for a second screen, `/stage`: stick and drum over the whole screen, to look at only."""
