"""Diffusion geometry: kernels, distances and their distributions; needs only a spectrum."""
