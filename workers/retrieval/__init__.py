"""Retrieval: channels, models, dissimilarities, ranking and its measures; arrays in and out."""
