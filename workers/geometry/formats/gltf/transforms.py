"""Where the nodes and instances of a glTF file stand."""

from typing import Any

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray
from workers.geometry.formats.gltf.accessors import Accessors
from workers.geometry.formats.gltf.document import Json, part

INSTANCING = "EXT_mesh_gpu_instancing"


def local_transforms(nodes: list[Json]) -> FloatArray:
    """Matrices of nodes, given as such, or as translation, rotation and scale.

    Parameters
    ----------
    nodes : list of dict
        Of the document; all at once, since there may be very many.

    Returns
    -------
    (n, 4, 4) float64
        Move columns (x, y, z, 1) from each node's coordinates to its parent's.

    Raises
    ------
    InvalidMeshError
        A list of another length, or one of no numbers.
    """
    transforms = compose(
        _numbers(nodes, "translation", [0.0, 0, 0]),
        _numbers(nodes, "rotation", [0.0, 0, 0, 1]),
        _numbers(nodes, "scale", [1.0, 1, 1]),
    )
    given = [index for index, node in enumerate(nodes) if node.get("matrix") is not None]
    if given:
        matrices = _numbers([nodes[index] for index in given], "matrix", [0.0] * 16)
        transforms[given] = matrices.reshape(-1, 4, 4).transpose(0, 2, 1)
    return transforms


def count_instances(node: Json, accessors: Accessors) -> int:
    """How often a node shows its mesh.

    Parameters
    ----------
    node : dict
        Of the document.
    accessors : Accessors
        Of the same document.

    Returns
    -------
    int
        1 without EXT_mesh_gpu_instancing.

    Raises
    ------
    InvalidMeshError
        Its attributes have different counts.
    """
    attributes = part(node, "extensions", INSTANCING, "attributes")
    counts = {accessors.count(index) for index in attributes.values()}
    if len(counts) > 1:
        raise InvalidMeshError(f"the instances of a node have attributes of {len(counts)} lengths")
    return counts.pop() if counts else 1


def instance_transforms(node: Json, accessors: Accessors) -> FloatArray:
    """Matrices of the instances of a node.

    Parameters
    ----------
    node : dict
        Of the document; the number of its instances was checked.
    accessors : Accessors
        Of the same document.

    Returns
    -------
    (k, 4, 4) float64
        From the mesh's coordinates to the node's; one identity without instancing.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        See `Accessors.values`.
    """
    attributes = part(node, "extensions", INSTANCING, "attributes")
    count = count_instances(node, accessors)

    def values(name: str, kind: str, missing: list[float]) -> FloatArray:
        if name not in attributes:
            return np.broadcast_to(np.array(missing), (count, len(missing)))
        found = accessors.values(attributes[name], kind)
        with np.errstate(invalid="ignore"):  # what is not a number is cleaning's to report
            return accessors.scaled(attributes[name], found).astype(np.float64)

    return compose(
        values("TRANSLATION", "VEC3", [0, 0, 0]),
        values("ROTATION", "VEC4", [0, 0, 0, 1]),
        values("SCALE", "VEC3", [1, 1, 1]),
    )


def compose(translations: FloatArray, rotations: FloatArray, scales: FloatArray) -> FloatArray:
    """Matrices of translation times rotation times scale.

    Parameters
    ----------
    translations, scales : (k, 3) float64
        Along the axes.
    rotations : (k, 4) float64
        Quaternions (x, y, z, w), of any length; none turns where all are 0.

    Returns
    -------
    (k, 4, 4) float64
        For columns (x, y, z, 1).
    """
    lengths = np.linalg.norm(rotations, axis=1, keepdims=True)
    with np.errstate(all="ignore"):  # what is not finite is cleaning's to report
        units = np.where(lengths > 0, rotations / lengths, rotations)
        x, y, z, w = units.T
        rows = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        turned = np.moveaxis(np.array(rows), 2, 0) * scales[:, None, :]  # (k, 3, 3)
    matrices = np.zeros((len(translations), 4, 4))
    matrices[:, :3, :3] = turned
    matrices[:, :3, 3] = translations
    matrices[:, 3, 3] = 1
    return matrices


def _numbers(nodes: list[Json], key: str, missing: list[float]) -> FloatArray:
    """Lists of numbers of nodes (n, length), each as long as the one for where it is missing."""
    values: list[Any] = [missing if node.get(key) is None else node[key] for node in nodes]
    try:
        found = np.array(values, dtype=np.float64)
    except (ValueError, TypeError, OverflowError):
        found = np.zeros(0)
    if nodes and found.shape != (len(nodes), len(missing)):
        raise InvalidMeshError(
            f"a node of the glTF file has a {key} that is no list of {len(missing)} numbers"
        )
    return found.reshape(len(nodes), len(missing))
