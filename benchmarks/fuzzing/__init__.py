"""Coverage-guided fuzzing of the readers of mesh files: ``python -m benchmarks.fuzzing``."""
