"""The paper's experiments again: benchmark, training, figures, Table 1 and a report."""
