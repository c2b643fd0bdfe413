"""Benchmarks: folders of transformed meshes, made from null shapes, and their upload."""

from workers.processor import compute_alike

compute_alike()  # before anything loads numpy
