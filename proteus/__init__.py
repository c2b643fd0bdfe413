"""What people hold of Proteus: the Python client, the command line, benchmarks, the paper again."""

from workers.processor import compute_alike

compute_alike()  # before anything loads numpy
