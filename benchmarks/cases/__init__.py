"""A folder of files with what is expected of each: ``python -m benchmarks.cases``."""
