"""What one reader makes of files, in a process of its own.

Run as a program with the reader's name and the bytes of memory it may take. It answers each path
on a line of its input with a line of JSON. It imports numpy and the reader alone, so that it also
runs under the Python of another environment.
"""

import importlib
import json
import os
import resource
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np

Arrays = tuple[Any, Any]
"""Vertices (n, 3) and triangles (m, 3)."""
Answer = dict[str, Any]
SURFACE_ENDINGS = "gii gii.gz pial white inflated sphere orig smoothwm"
MESHLAB_ENDINGS = "3ds 3mf ctm dae glb gltf obj off ply pts qobj stl vmi wrl x3d"


def facts(vertices: Any, faces: Any) -> Answer:
    """Return what a mesh is compared by; the same code for every reader.

    Corners that coincide in single precision are one corner. Triangles with a corner that is not
    finite are counted apart.
    """
    vertices = np.asarray(vertices, dtype=np.float64).reshape(-1, 3)
    faces = np.asarray(faces, dtype=np.int64).reshape(-1, 3)
    if len(faces) and (faces.min() < 0 or faces.max() >= len(vertices)):
        return {"error": "returned indices out of range", "type": "nonsense"}
    sound = np.isfinite(vertices).all(axis=1)[faces].all(axis=1)
    corners = vertices[faces[sound]]  # (m, 3, 3)
    answer: Answer = {"faces": len(faces), "vertices": len(vertices)}
    if not sound.all():
        answer["faces_not_finite"] = int((~sound).sum())
    if not len(corners):
        return answer | {"area": 0.0, "components": 0, "low": [0.0] * 3, "high": [0.0] * 3}
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    points = corners.reshape(-1, 3)
    return answer | {
        "area": float(0.5 * np.linalg.norm(normals, axis=1).sum()),
        "components": count_components(points),
        "low": points.min(axis=0).tolist(),
        "high": points.max(axis=0).tolist(),
    }


def count_components(corners: Any) -> int:
    """Count the connected pieces of triangles given by their corners, (3 m, 3)."""
    single = np.ascontiguousarray(corners.astype(np.float32) + np.float32(0.0))  # -0.0 is 0.0
    keys = single.view(np.dtype((np.void, 12))).ravel()
    _, places = np.unique(keys, return_inverse=True)
    faces = places.reshape(-1, 3)
    labels = np.arange(faces.max() + 1)
    while True:
        least = labels[faces].min(axis=1)  # (m,)
        updated = labels.copy()
        np.minimum.at(updated, labels[faces].ravel(), np.repeat(least, 3))
        while not np.array_equal(shorter := updated[updated], updated):
            updated = shorter
        if np.array_equal(updated, labels):
            return len(np.unique(labels[faces[:, 0]]))
        labels = updated


def ours() -> tuple[str, list[str] | None, Callable[[str], Answer]]:
    """Parse and clean as an upload is; takes files of every name."""
    formats = importlib.import_module("workers.geometry.formats")
    packing = importlib.import_module("workers.geometry.formats.gltf.packing")
    clean = importlib.import_module("workers.geometry.cleaning").clean

    def read(path: str) -> Answer:
        data = Path(path).read_bytes()
        if path.lower().endswith(".gltf"):  # as an upload with the files beside it
            beside = {name: Path(path).parent / name for name in packing.referenced_files(data)}
            files = {name: one.read_bytes() for name, one in beside.items() if one.is_file()}
            data = packing.pack_glb(data, files) if files else data
        parsed = formats.parse(data, filename=os.path.basename(path))
        answer = facts(parsed.mesh.vertices, parsed.mesh.faces)
        answer |= {"format": parsed.format, "said": [*parsed.repairs, *parsed.found]}
        try:
            cleaned = clean(parsed.mesh)
        except Exception as error:
            return answer | {"cleaned": words_of(error)}
        kept = facts(cleaned.mesh.vertices, cleaned.mesh.faces)
        return answer | {"cleaned": kept | {"said": list(cleaned.repairs)}}

    return "", None, read


def trimesh() -> tuple[str, list[str] | None, Callable[[str], Answer]]:
    """Read as trimesh does when it is told to change nothing; a scene is put together."""
    library = importlib.import_module("trimesh")

    def read(path: str) -> Answer:
        scene = library.load_scene(path, process=False)
        meshes = [one for one in scene.dump() if hasattr(one, "faces")]
        return facts(*joined((one.vertices, one.faces) for one in meshes))

    return library.__version__, sorted(library.available_formats()), read


def meshio() -> tuple[str, list[str] | None, Callable[[str], Answer]]:
    """Read triangles, quadrangles and polygons; other cells are left out."""
    library = importlib.import_module("meshio")

    def read(path: str) -> Answer:
        mesh = library.read(path)
        points = np.zeros((len(mesh.points), 3))
        points[:, : mesh.points.shape[1]] = mesh.points[:, :3]
        faces = [fan(cells.data) for cells in mesh.cells if cells.dim == 2]
        return facts(*joined((points, rows) for rows in faces))

    return library.__version__, sorted(e[1:] for e in library.extension_to_filetypes), read


def nibabel() -> tuple[str, list[str] | None, Callable[[str], Answer]]:
    """Read brain surfaces: GIFTI, and FreeSurfer's by their usual names."""
    library = importlib.import_module("nibabel")

    def read(path: str) -> Answer:
        if ".gii" not in path.lower():
            return facts(*library.freesurfer.read_geometry(path)[:2])
        image = library.load(path)
        points = image.agg_data("NIFTI_INTENT_POINTSET")
        return facts(points, image.agg_data("NIFTI_INTENT_TRIANGLE"))

    return library.__version__, SURFACE_ENDINGS.split(), read


def meshlab() -> tuple[str, list[str] | None, Callable[[str], Answer]]:
    """Read as MeshLab does; all its layers are put together."""
    library = importlib.import_module("pymeshlab")
    version = importlib.import_module("importlib.metadata").version("pymeshlab")

    def read(path: str) -> Answer:
        layers = library.MeshSet()
        layers.load_new_mesh(path)
        return facts(*joined((m.transformed_vertex_matrix(), m.face_matrix()) for m in layers))

    return version, MESHLAB_ENDINGS.split(), read


READERS = {
    **{"ours": ours, "trimesh": trimesh, "meshio": meshio},
    **{"meshlab": meshlab, "nibabel": nibabel},
}


def fan(cells: Any) -> Any:
    """Cut polygons of one size, or of any, into triangles from their first corner."""
    if isinstance(cells, np.ndarray) and cells.ndim == 2:
        size = cells.shape[1]
        return np.concatenate([cells[:, [0, i, i + 1]] for i in range(1, size - 1)])
    rows = [(row[0], row[i], row[i + 1]) for row in cells for i in range(1, len(row) - 1)]
    return np.array(rows).reshape(-1, 3)


def joined(parts: Iterator[Arrays]) -> Arrays:
    """Put meshes together into one."""
    vertices, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.int64)], 0
    for points, rows in parts:
        vertices.append(np.asarray(points, dtype=np.float64).reshape(-1, 3))
        faces.append(np.asarray(rows, dtype=np.int64).reshape(-1, 3) + count)
        count += len(points)
    return np.concatenate(vertices), np.concatenate(faces)


def words_of(error: BaseException, path: str = "", printed: str = "") -> Answer:
    """Return an error in a line; what was printed stands for the words of a reader that exits."""
    text = printed if isinstance(error, SystemExit) else str(error)
    words = " ".join(text.replace(path, "").split()) if path else text
    return {"error": words[:300] or type(error).__name__, "type": type(error).__name__}


def limit_memory(size: int) -> None:
    """Let the process take so many bytes more than it has; numpy then raises ``MemoryError``."""
    with open("/proc/self/statm") as file:
        taken = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (taken + size, taken + size))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def main() -> None:
    """Answer paths until the input ends."""
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    version, endings, read = READERS[sys.argv[1]]()
    limit_memory(int(sys.argv[2]))
    with tempfile.TemporaryFile() as printed:
        for stream in (1, 2):  # some readers print, and meshio then exits
            os.dup2(printed.fileno(), stream)
        print(json.dumps({"version": version, "endings": endings}), file=answers)
        for line in sys.stdin:
            print(json.dumps(answer(json.loads(line), read, printed)), file=answers)


def answer(path: str, read: Callable[[str], Answer], printed: IO[bytes]) -> Answer:
    """Return what a reader makes of one file, with the time that it took."""
    start = time.perf_counter()
    try:
        found = read(path)
    except BaseException as error:  # whatever a reader raises is its answer
        printed.seek(0)
        found = words_of(error, path, printed.read(1000).decode(errors="replace"))
    printed.seek(0)
    printed.truncate()
    return found | {"seconds": round(time.perf_counter() - start, 3)}


if __name__ == "__main__":
    main()
