"""Measurements beside the tests: retrieval, survival, calibration; none is run by the suite."""
