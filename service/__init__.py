"""The HTTP door of Proteus: API, search index, command line and supervisor."""

from workers.processor import compute_alike

compute_alike()  # before anything loads numpy
