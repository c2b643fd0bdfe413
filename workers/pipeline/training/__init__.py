"""Trainings as rows and blobs: planned, computed example after example, and fitted."""
