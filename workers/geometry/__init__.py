"""Meshes, formats, Laplacian, spectrum, sampling: arrays in, arrays out."""
