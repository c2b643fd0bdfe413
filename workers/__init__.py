"""The engine of Proteus: geometry, diffusion, retrieval, storage, pipeline and tasks."""

from workers.processor import compute_alike

compute_alike()  # before anything loads numpy
