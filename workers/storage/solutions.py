"""What was computed of a mesh, as blobs: the cleaned mesh, and its solution under a view.

Eigenvectors are kept in half precision, as those of the surface at area 1: about 1 MB a shape,
and retrieval was measured level with double precision. Descriptors are made from what is read
back, never from what is still in memory. So a shape described at its upload and one described
again later have the same bits.
"""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workers.errors import BlobNotFoundError
from workers.geometry.mesh import TriangleMesh
from workers.geometry.sampling import SAMPLES, SurfaceSample
from workers.geometry.solution import Part, Solution, united
from workers.geometry.spectrum import Spectrum
from workers.geometry.views import View
from workers.storage.arrays import pack, unpack
from workers.storage.blobs import BlobStore, cleaned_key, spectrum_key


def store_cleaned(blobs: BlobStore, sha256: str, mesh: TriangleMesh) -> None:
    """Store the cleaned mesh of an upload.

    Parameters
    ----------
    blobs : BlobStore
        Where it goes.
    sha256 : str
        Hash of the uploaded bytes.
    mesh : TriangleMesh
        The cleaned mesh; its vertices are stored in double precision.
    """
    faces = mesh.faces.astype(np.int32)
    blobs.put(cleaned_key(sha256), pack({"vertices": mesh.vertices, "faces": faces}))


def load_cleaned(blobs: BlobStore, sha256: str) -> TriangleMesh:
    """Return the cleaned mesh of an upload.

    Parameters
    ----------
    blobs : BlobStore
        Where it is.
    sha256 : str
        Hash of the uploaded bytes.

    Returns
    -------
    The mesh that `store_cleaned` was given, bit for bit.

    Raises
    ------
    BlobNotFoundError
        It was not computed.
    """
    arrays = unpack(blobs.get(cleaned_key(sha256)))
    return TriangleMesh(arrays["vertices"], arrays["faces"])


def store_solution(
    blobs: BlobStore, sha256: str, view: View, solution: Solution, *, cleaned: TriangleMesh
) -> Solution:
    """Store the solution of an upload under a view.

    Parameters
    ----------
    blobs : BlobStore
        Where it goes.
    sha256 : str
        Hash of the uploaded bytes, or of a mesh that was made.
    view : View
        How the working mesh was prepared.
    solution : Solution
        Working mesh and spectrum.
    cleaned : TriangleMesh
        What was prepared and solved: a later version may clean the same upload otherwise.

    Returns
    -------
    The solution as it will be read back: vertices in single and eigenvectors in half precision,
    with a sample taken of those.
    """
    arrays: dict[str, NDArray[Any]] = {}
    if not solution.parts:
        arrays = _arrays(solution)
    else:
        for number, part in enumerate(solution.parts):
            own = _arrays(part.solution)
            arrays |= {f"{number}/{name}": array for name, array in own.items()}
        arrays |= {
            "weights": np.array([part.weight for part in solution.parts]),
            "copies": np.array([part.copies for part in solution.parts]),
            "bodies": np.array([part.body for part in solution.parts]),
        }
    arrays["cleaned"] = _digest(cleaned)
    blobs.put(spectrum_key(sha256, view.key), pack(arrays))
    return _read(arrays)


def load_solution(
    blobs: BlobStore, sha256: str, view: View, *, cleaned: TriangleMesh | None = None
) -> Solution:
    """Return the solution of an upload under a view.

    Parameters
    ----------
    blobs : BlobStore
        Where it is.
    sha256 : str
        Hash of the uploaded bytes, or of a mesh that was made.
    view : View
        How the working mesh was prepared.
    cleaned : TriangleMesh, optional
        What it must have been solved from.

    Returns
    -------
    What `store_solution` returned.

    Raises
    ------
    BlobNotFoundError
        It was not computed, or of another cleaned mesh: by an earlier version of cleaning.
    """
    key = spectrum_key(sha256, view.key)
    arrays = unpack(blobs.get(key))
    if cleaned is not None and not np.array_equal(arrays.get("cleaned", ()), _digest(cleaned)):
        raise BlobNotFoundError(f"{key} was computed of a mesh that was cleaned otherwise")
    return _read(arrays)


def _digest(mesh: TriangleMesh) -> NDArray[np.uint8]:
    """SHA-256 of a mesh's arrays, (32,)."""
    digest = hashlib.sha256(mesh.vertices.tobytes())
    digest.update(mesh.faces.tobytes())
    return np.frombuffer(digest.digest(), dtype=np.uint8)


def _arrays(solution: Solution) -> dict[str, NDArray[Any]]:
    """What is stored of a connected surface, with a sample of what will be read back."""
    mesh, spectrum = solution.mesh, solution.spectrum
    arrays: dict[str, NDArray[Any]] = {
        "vertices": mesh.vertices.astype(np.float32),
        "faces": mesh.faces.astype(np.int32),
        "eigenvalues": spectrum.eigenvalues,
        "eigenvectors": (spectrum.eigenvectors * np.sqrt(spectrum.area)).astype(np.float16),
        "areas": spectrum.areas,
        "area": np.array(spectrum.area),
    }
    if solution.notes:
        text = json.dumps(solution.notes).encode()
        arrays["notes"] = np.frombuffer(text, dtype=np.uint8)
    kept = _read_connected(arrays)
    if kept.spectrum.n_eigenpairs:
        sample = kept.sample()
        arrays |= {
            "sample_indices": sample.indices.astype(np.int32),
            "sample_weights": sample.weights,
        }
    return arrays


def _read(arrays: Mapping[str, NDArray[Any]]) -> Solution:
    """Solution of what was stored, of one component or several."""
    if "weights" not in arrays:
        return _read_connected(arrays)
    parts = []
    numbers = (arrays[name].tolist() for name in ("weights", "copies", "bodies"))
    for number, (weight, copies, body) in enumerate(zip(*numbers, strict=True)):
        prefix = f"{number}/"
        own = {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}
        parts.append(Part(_read_connected(own), weight, copies, body))
    return united(parts)


def _read_connected(arrays: Mapping[str, NDArray[Any]]) -> Solution:
    area = float(arrays["area"])
    spectrum = Spectrum(
        eigenvalues=arrays["eigenvalues"],
        eigenvectors=arrays["eigenvectors"].astype(np.float64) / np.sqrt(area),
        areas=arrays["areas"],
        area=area,
    )
    samples = {}
    if "sample_indices" in arrays:  # not there if stored before samples were kept
        samples[SAMPLES] = SurfaceSample(arrays["sample_indices"], arrays["sample_weights"])
    mesh = TriangleMesh(arrays["vertices"], arrays["faces"])
    notes = tuple(json.loads(arrays["notes"].tobytes())) if "notes" in arrays else ()
    return Solution(mesh, spectrum, samples, notes=notes)
