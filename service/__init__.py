"""The HTTP door of Proteus: API, search index, supervisor and page."""

from workers.processor import compute_alike

compute_alike()  # before anything loads numpy
