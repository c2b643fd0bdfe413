"""One way of computing, whatever the processor: what was chosen is what numpy and BLAS do."""

import ctypes
import importlib
import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import scipy

from workers import processor
from workers.processor import AVX2_ALONE, NEEDED, ONE_THREAD, compute_alike

WIDEST = "X86_V3"
HAS_AVX2 = processor._features() >= NEEDED
needs_avx2 = pytest.mark.skipif(not HAS_AVX2, reason="no x86-64 processor with AVX2")

ANSWER = """
import workers  # whatever else the process does, it begins with this
import hashlib
from workers.creatures import make_creature
from workers.geometry.views import named_view, window_view
from workers.geometry.solution import Solver, solve
from workers.retrieval.windows.signature import query_signature, stored_signature, window_surface

horse = make_creature("horse", seed=1, vertices=2000).posed(2)
found = solve(horse, named_view("smooth"))
print(hashlib.sha256(found.spectrum.eigenvectors.tobytes()).hexdigest())
prepared = Solver(horse).prepared(window_view())
for for_query, signature in ((False, stored_signature), (True, query_signature)):
    surface = window_surface(prepared, n_vertices=horse.n_vertices, for_query=for_query)
    arrays = signature(surface).to_arrays()
    print([hashlib.sha256(array.tobytes()).hexdigest() for array in arrays.values()])
"""


@needs_avx2
def test_numpy_uses_nothing_wider() -> None:
    core = importlib.import_module("numpy._core._multiarray_umath")
    features, dispatched = core.__cpu_features__, core.__cpu_dispatch__
    wider = dispatched[dispatched.index(WIDEST) + 1 :]
    assert features[WIDEST]
    assert [name for name in wider if features[name]] == []
    assert set(wider) <= set(AVX2_ALONE["NPY_DISABLE_CPU_FEATURES"].split())


@needs_avx2
@pytest.mark.parametrize("package", [np, scipy], ids=["numpy", "scipy"])
def test_blas_computes_as_on_the_first_of_them(package: object) -> None:
    folder = Path(str(package.__file__)).parents[1]  # type: ignore[attr-defined]
    found = sorted(folder.glob(f"{package.__name__}.libs/libscipy_openblas*"))  # type: ignore[attr-defined]
    if not found:
        pytest.skip("this build has another BLAS")
    library = ctypes.CDLL(str(found[0]))
    suffix = "64_" if "64_" in found[0].name else ""
    name = getattr(library, f"scipy_openblas_get_corename{suffix}")
    name.restype = ctypes.c_char_p
    assert name().decode() == "Haswell"


@needs_avx2
@pytest.mark.parametrize(
    "found_by_others",
    [{"OPENBLAS_CORETYPE": "SkylakeX"}, {"OPENBLAS_CORETYPE": "Nehalem", "OMP_NUM_THREADS": "2"}],
    ids=["a newer one", "an older one"],
)
def test_a_process_that_was_told_otherwise_computes_alike(
    found_by_others: dict[str, str],
) -> None:
    answers = {
        subprocess.run(
            [sys.executable, "-c", ANSWER],
            env={**os.environ, **environment},
            capture_output=True,
            check=True,
        ).stdout
        for environment in ({}, {**found_by_others, "NPY_DISABLE_CPU_FEATURES": ""})
    }
    assert len(answers) == 1


@pytest.mark.parametrize(
    ("machine", "flags", "is_alike"),
    [
        ("x86_64", "fpu avx avx2 fma bmi2 avx512f", True),
        ("x86_64", "fpu sse4_2 avx", False),
        ("aarch64", "fp asimd", False),
    ],
)
def test_other_processors_stay_as_they_are(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    machine: str,
    flags: str,
    *,
    is_alike: bool,
) -> None:
    told = tmp_path / "cpuinfo"
    told.write_text(f"processor\t: 0\nflags\t\t: {flags}\n\nprocessor\t: 1\n")
    monkeypatch.setattr(processor, "CPUINFO", told)
    monkeypatch.setattr(platform, "machine", lambda: machine)
    for name in (*ONE_THREAD, *AVX2_ALONE):
        monkeypatch.delenv(name, raising=False)
    compute_alike()
    assert all(os.environ[name] == "1" for name in ONE_THREAD)
    assert all((os.environ.get(name) == value) == is_alike for name, value in AVX2_ALONE.items())
