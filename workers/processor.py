"""One way of computing on every processor, chosen before numpy is loaded.

numpy and BLAS take the widest instructions that they find, and as many threads. Sums then come out
in another order, the last bits differ from machine to machine, and where triangles are collapsed
one after the other a last bit decides which mesh is left. So every x86-64 processor with AVX2 and
FMA is told to compute as the first of them did: the same bytes give the same descriptor whichever
worker takes them, and a model trained again is the same file (`docs/decisions/0014`).
"""

import os
import platform
from pathlib import Path

ONE_THREAD = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"
)  # two threads a process cost 8 to 16 times, where there are as many processes as processors
AVX2_ALONE = {
    "OPENBLAS_CORETYPE": "Haswell",
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
}
NEEDED = {"avx2", "fma", "bmi2"}
CPUINFO = Path("/proc/cpuinfo")


def compute_alike() -> None:
    """Set the environment of this process and its children; without effect once numpy is loaded.

    Other processors than x86-64 with AVX2 and FMA stay as they are: their results are their own.
    """
    os.environ.update(ONE_THREAD)
    if _features() >= NEEDED:
        os.environ.update(AVX2_ALONE)


def _features() -> set[str]:
    """Features of an x86-64 processor, as Linux names them; nothing elsewhere."""
    if platform.machine() not in {"x86_64", "AMD64"} or not CPUINFO.is_file():
        return set()
    lines = CPUINFO.read_text(encoding="ascii", errors="replace").splitlines()
    told = next((line for line in lines if line.startswith("flags")), "")
    return set(told.partition(":")[2].split())
