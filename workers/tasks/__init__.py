"""Celery: a message wakes a worker for one part of a job."""
