"""XML from hostile files, as a stream."""
