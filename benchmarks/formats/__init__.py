"""The readers of mesh files beside those of other programs: ``python -m benchmarks.formats``."""
