"""Benchmarks as folders of meshes: made of null shapes, and measured on a running service."""
