"""What loose parts do to an answer: distance and rank of a body's clean self, by the parts' share.

``python -m benchmarks.fragments [--model NAME]``

Three creatures get two balls each, inside, outside or touching, from 0.5 to 10 per cent of the
body's area. Each is a query among the clean creatures of all species. Printed are the distance to
the clean self, its rank, and the distance of the nearest other creature. Then come surfaces of many
parts: 2, 100, 125 and 300 equal ones, a machine of 300 different ones, and a tree whose 400 leaves
have 44 per cent of the area. A copy of each, in other places, scaled, and with noise, is a query
among them, the creatures, and a single one of the parts.
"""

import argparse
from collections.abc import Iterator

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from tests.meshes import box, bumpy_sphere, icosphere, random_rotation, union
from workers.creatures import SPECIES, TESTED_SPECIES, make_creature
from workers.geometry.arrays import Float32Array, FloatArray
from workers.geometry.cleaning import clean
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import solve
from workers.retrieval.builtin import built_in_models
from workers.retrieval.model import Model, describe
from workers.retrieval.scan import distances, rerank, similarity
from workers.storage.shipped_models import shipped_model

BODIES = TESTED_SPECIES[:3]
SHARES = (0.005, 0.011, 0.02, 0.05, 0.1)
PLACES = ("inside", "outside", "touching")
SEED = 7


def descriptor(mesh: TriangleMesh, model: Model) -> Float32Array:
    """Descriptor of a mesh as it would be of an upload."""
    cleaned = clean(mesh).mesh
    return describe({view.name: solve(cleaned, view) for view in model.views}, model)


def with_balls(body: TriangleMesh, share: float, place: str) -> TriangleMesh:
    """A body with two balls, each of this share of its area."""
    radius = float(np.sqrt(share * body.area / (4.0 * np.pi)))
    ball = icosphere(2, radius)
    low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
    middle = body.vertices.mean(axis=0)
    if place == "inside":
        centres = [middle, middle + 0.1 * (high - low)]
    elif place == "outside":
        centres = [high + 3.0 * radius, low - 3.0 * radius]
    else:  # one vertex of each ball lies in a vertex of the body
        tips = body.vertices[[int(body.vertices[:, 0].argmax()), int(body.vertices[:, 1].argmax())]]
        centres = [tips[0] - ball.vertices[0], tips[1] - ball.vertices[1]]
    return union(body, *(TriangleMesh(ball.vertices + centre, ball.faces) for centre in centres))


def heap(parts: list[TriangleMesh], seed: int, *, noise: float = 0.0) -> TriangleMesh:
    """Parts in a row of places, each turned at random, with noise in units of its own size."""
    rng = np.random.default_rng(seed)
    placed = []
    for number, part in enumerate(parts):
        size = float(np.sqrt(part.area))
        moved = part.vertices + noise * size * rng.standard_normal(part.vertices.shape)
        turned = moved @ random_rotation(rng).T
        place = 4.0 * np.array([number % 20, number // 20, rng.uniform()])
        placed.append(TriangleMesh(turned + place, part.faces))
    return union(*placed)


def many_parts() -> Iterator[tuple[str, list[TriangleMesh]]]:
    """Name and parts of surfaces that fall into many."""
    rng = np.random.default_rng(SEED)
    ball, bumpy = icosphere(2), bumpy_sphere(2)
    yield "2 equal halves", [bumpy_sphere(3, seed=5)] * 2
    yield "100 equal boxes", [box(1.0, 0.7, 0.4)] * 100
    yield "125 equal balls", [ball] * 125
    yield "300 equal parts", [bumpy] * 300
    sizes = rng.uniform(0.3, 1.0, size=(300, 3))
    yield "machine of 300 parts", [box(*size) for size in sizes.tolist()]
    tree = make_creature(TESTED_SPECIES[3], seed=1).rest
    leaf = box(1.0, 0.6, 0.1)
    factor = np.sqrt(0.44 / 0.56 * tree.area / (400 * leaf.area))
    leaves = [TriangleMesh(leaf.vertices * factor, leaf.faces)] * 400
    yield "tree with 400 leaves", [tree, *leaves]
    yield "the tree alone", [tree]
    yield "a single ball", [ball]
    yield "a single bumpy part", [bumpy]


def answers(query: Float32Array, rows: Float32Array, model: Model) -> FloatArray:
    """Distances of a query to all rows, as a search has them."""
    return rerank(query, lambda places: rows[places], distances(query, rows, model), model)


def show(
    title: str,
    names: list[str],
    rows: Float32Array,
    asked: list[tuple[str, str, Float32Array]],
    model: Model,
) -> None:
    """Print where each query finds the shape that it is made from."""
    table = Table(
        "query", "made from", "rank", "distance", "similarity", "nearest other", title=title
    )
    for query, truth, vector in asked:
        found = answers(vector, rows, model)
        own = names.index(truth)
        others = np.delete(found, own)
        rank = 1 + int((others < found[own]).sum())
        close = similarity(found[own : own + 1], model)[0]
        table.add_row(
            query, truth, str(rank), f"{found[own]:.3f}", f"{close:.3f}", f"{others.min():.3f}"
        )
    Console(width=160).print(table)


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", default="proteus", help="or a built-in one")
    parser.add_argument("--only", choices=["balls", "parts"], help="one of both tables")
    arguments = parser.parse_args()
    known = {model.name: model for model in built_in_models()}
    model = known.get(arguments.model) or shipped_model()
    progress = Console(stderr=True)

    def described(meshes: dict[str, TriangleMesh], what: str) -> dict[str, Float32Array]:
        told = track(meshes.items(), what, len(meshes), console=progress)
        return {name: descriptor(mesh, model) for name, mesh in told}

    creatures = {name: make_creature(name, seed=3).posed(0) for name in SPECIES}
    known_rows = described(creatures, "creatures")
    names, rows = [*known_rows], np.stack([*known_rows.values()])
    if arguments.only != "parts":
        meshes = {
            f"{body}\t{share:.1%} each, {place}": with_balls(creatures[body], share, place)
            for body in BODIES
            for place in PLACES
            for share in SHARES
        }
        found = described(meshes, "with balls")
        asked = [(name.split("\t")[1], name.split("\t")[0], row) for name, row in found.items()]
        show("two balls beside a body", names, rows, asked, model)
    if arguments.only != "balls":
        parts = dict(many_parts())
        own = described({name: heap(one, SEED) for name, one in parts.items()}, "many parts")
        copies = {name: scaled_heap(one) for name, one in parts.items()}
        asked = [
            (f"{n}, other places, noise", n, row) for n, row in described(copies, "copies").items()
        ]
        rows = np.concatenate([rows, np.stack([*own.values()])])
        show("surfaces of many parts", [*names, *own], rows, asked, model)


def scaled_heap(parts: list[TriangleMesh]) -> TriangleMesh:
    """The parts in other places and turns, three times as large, with noise."""
    mesh = heap(parts, SEED + 1, noise=0.005)
    return TriangleMesh(3.0 * mesh.vertices, mesh.faces)


if __name__ == "__main__":
    main()
