"""The engine of Proteus: geometry, diffusion, retrieval, storage, pipeline and tasks."""
