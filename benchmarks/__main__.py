"""``python -m benchmarks``: what needs no running service, measured beside peers."""

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"  # before numpy

from benchmarks.spectrum import main  # noqa: E402

main()
