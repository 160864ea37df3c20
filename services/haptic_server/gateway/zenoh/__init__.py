"""The gateway's Zenoh side: queries, sets, pointers, contact pieces, scene changes."""
