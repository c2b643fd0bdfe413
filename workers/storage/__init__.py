"""Rows, blobs and the change feed: all that Proteus remembers."""
