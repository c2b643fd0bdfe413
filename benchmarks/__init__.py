"""Measurements beside the tests: retrieval, survival, calibration; none is run by the suite."""

from workers.processor import compute_alike

compute_alike()  # before anything loads numpy
