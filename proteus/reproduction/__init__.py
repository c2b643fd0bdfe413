"""The paper's experiments again: its figures, its Table 1, and a report."""

from workers.processor import compute_alike

compute_alike()  # before anything loads numpy
