"""Search: the matrix of one (collection, model), filters, and ranking."""
