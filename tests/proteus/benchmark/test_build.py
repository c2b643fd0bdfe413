import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from proteus.benchmark.build import build_benchmark, read_benchmark
from proteus.benchmark.plan import (
    COMMON_AREA,
    BenchmarkOptions,
    near_twins,
    plan_shapes,
    pose_number,
)
from proteus.benchmark.sources import CreatureMesh
from tests.meshes import bumpy_sphere, scaled
from workers.creatures import (
    SPECIES,
    TESTED_SPECIES,
    TRAINING_SPECIES,
    make_creature,
)
from workers.errors import InvalidRequestError
from workers.geometry.formats import parse, write
from workers.geometry.formats.naming import read_name
from workers.geometry.mesh import TriangleMesh

TWO = ("isometry", "scale")


def mesh_of(path: Path) -> TriangleMesh:
    return parse(path.read_bytes(), filename=path.name).mesh


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def zoo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two creatures' nulls, three poses of one of them, and something that is no pose."""
    folder = tmp_path_factory.mktemp("zoo")
    for species in ("worm", "cat"):
        creature = make_creature(species, seed=1, vertices=2000)
        place = folder / species
        place.mkdir()
        (place / f"{species}-reference.ply").write_bytes(write(creature.rest, "ply"))
        for pose in range(1, 4) if species == "worm" else ():
            (place / f"pose-{pose}.ply").write_bytes(write(creature.posed(pose), "ply"))
    (folder / "worm" / "a-sphere.ply").write_bytes(write(bumpy_sphere(2), "ply"))
    return folder


def tiny(zoo: Path, **more: object) -> BenchmarkOptions:
    options = {"nulls": zoo, "poses": zoo, "transformations": TWO, "strengths": (1,), **more}
    return BenchmarkOptions(**options)  # type: ignore[arg-type]


def test_a_benchmark_has_a_null_and_all_queries_of_each_shape(zoo: Path, tmp_path: Path) -> None:
    steps: list[tuple[int, int]] = []
    built = build_benchmark(
        tiny(zoo), tmp_path / "out", processes=2, advance=lambda *step: steps.append(step)
    )
    assert steps[0] == (0, 6)
    assert steps[-1] == (6, 6)
    assert built.manifest["counts"] == {"nulls": 2, "distractors": 0, "queries": 4}
    made = set(contents(tmp_path / "out")) - {"benchmark.json"}
    assert [path.name for path in built.files] == sorted(made)
    named = {
        (n.label, n.transformation, n.strength) for n in (read_name(p.name) for p in built.files)
    }
    assert named == {
        (label, how, strength)
        for label in ("worm", "cat")
        for how, strength in (("null", 0), ("isometry", 1), ("scale", 1))
    }
    assert built.manifest["left_out"] == [
        {"file": "worm/a-sphere.ply", "reason": "it has 162 vertices, the null shape 1936"}
    ]
    assert read_benchmark(tmp_path / "out").manifest == built.manifest


def test_the_null_is_the_file_and_isometry_is_a_pose(zoo: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    build_benchmark(tiny(zoo, strengths=(1, 2)), out, processes=1)
    null, given = mesh_of(out / "worm.null.0.ply"), mesh_of(zoo / "worm" / "worm-reference.ply")
    assert_array_equal(null.vertices, given.vertices)
    assert_array_equal(null.faces, given.faces)
    for strength in (1, 2):
        bent = mesh_of(out / f"worm.isometry.{strength}.ply")
        pose = mesh_of(zoo / "worm" / f"pose-{strength}.ply")
        assert_array_equal(bent.vertices, pose.vertices)


def test_scale_is_applied_to_the_null_shape_itself(zoo: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    build_benchmark(tiny(zoo), out, processes=1)
    null, large = (mesh_of(out / f"worm.{name}.ply") for name in ("null.0", "scale.1"))
    spans = [np.linalg.norm(np.ptp(mesh.vertices, axis=0)) for mesh in (null, large)]
    lengths = [np.linalg.norm(m.vertices[1:] - m.vertices[:-1], axis=1) for m in (null, large)]
    ratio = lengths[1] / lengths[0]
    assert ratio.std() < 1e-9 * ratio.mean()  # similar: a pose is not
    assert spans[0] != pytest.approx(spans[1])


def test_queries_stand_on_different_poses_in_turn() -> None:
    numbers = [pose_number(how, s) for how in ("isometry", "topology") for s in range(1, 6)]
    assert numbers == list(range(10))


def test_shapes_are_brought_to_one_area_with_their_poses(zoo: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    big = tmp_path / "nulls"
    for path in zoo.rglob("*.ply"):
        place = big / path.parent.name / path.name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(write(scaled(mesh_of(path), 100.0), "ply"))
    options = tiny(big, poses=big, normalise="area", creatures=1, creature_vertices=2000)
    build_benchmark(options, out, processes=1)
    for path in out.glob("*.null.0.ply"):
        assert_allclose(mesh_of(path).area, COMMON_AREA, rtol=1e-9)
    pose = mesh_of(zoo / "worm" / "pose-1.ply")
    factor = np.sqrt(COMMON_AREA / mesh_of(zoo / "worm" / "worm-reference.ply").area)
    bent = mesh_of(out / "worm.isometry.1.ply")
    assert_allclose(bent.vertices, factor * pose.vertices, rtol=1e-9)


def test_the_same_options_give_the_same_bytes_on_any_number_of_processes(
    zoo: Path, tmp_path: Path
) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    build_benchmark(tiny(zoo), one, processes=1)
    build_benchmark(tiny(zoo), two, processes=2)
    assert contents(one) == contents(two)
    other = build_benchmark(tiny(zoo, seed=1), tmp_path / "other", processes=1)
    assert contents(one)["cat.isometry.1.ply"] != contents(other.folder)["cat.isometry.1.ply"]


def test_an_interrupted_build_goes_on_where_it_was(zoo: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    build_benchmark(tiny(zoo), out, processes=1)
    whole = contents(out)
    manifest = json.loads((out / "benchmark.json").read_text())
    (out / "benchmark.json").write_text(json.dumps({**manifest, "complete": False}))
    (out / "cat.scale.1.ply").unlink()
    (out / "worm.scale.1.part").write_bytes(b"half")
    kept = (out / "cat.null.0.ply").stat().st_mtime_ns
    with pytest.raises(InvalidRequestError, match="is not finished"):
        read_benchmark(out)
    build_benchmark(tiny(zoo), out, processes=1)
    assert contents(out) == whole
    assert (out / "cat.null.0.ply").stat().st_mtime_ns == kept


def test_a_folder_of_something_else_is_left_alone(zoo: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    build_benchmark(tiny(zoo), out, processes=1)
    with pytest.raises(InvalidRequestError, match=r"another benchmark \(its parameters differ\)"):
        build_benchmark(tiny(zoo, seed=3), out, processes=1)
    with pytest.raises(InvalidRequestError, match=r"holds no benchmark.json; see"):
        read_benchmark(zoo)
    with pytest.raises(InvalidRequestError, match="is not empty and holds no"):
        build_benchmark(tiny(zoo), zoo, processes=1)


def test_a_null_that_cannot_be_read_is_named_and_left_out(zoo: Path, tmp_path: Path) -> None:
    nulls = tmp_path / "nulls"
    nulls.mkdir()
    (nulls / "worm.ply").write_bytes((zoo / "worm" / "worm-reference.ply").read_bytes())
    (nulls / "broken.ply").write_bytes(b"ply\nformat ascii 1.0\nelement vertex 3\n")
    built = build_benchmark(tiny(nulls, poses=None), tmp_path / "out", processes=1)
    assert [failure["label"] for failure in built.manifest["failures"]] == ["broken"]
    assert built.manifest["failures"][0]["reason"]
    assert {path.name.split(".")[0] for path in built.files} == {"worm"}
    assert set(contents(tmp_path / "out")) == {"benchmark.json", *(p.name for p in built.files)}
    assert built.manifest["counts"]["nulls"] == 1


def test_creatures_are_of_the_species_that_training_leaves_and_distractors_are_no_queries() -> None:
    shapes = plan_shapes(BenchmarkOptions(creatures=6, creature_distractors=50))
    queries = [shape for shape in shapes if shape.is_query]
    assert {shape.label for shape in queries} <= set(TESTED_SPECIES)
    assert {*TESTED_SPECIES, *TRAINING_SPECIES} == set(SPECIES)
    made = {shape.source.species for shape in shapes if isinstance(shape.source, CreatureMesh)}
    assert not made & set(TRAINING_SPECIES)
    assert len(queries) == 6
    assert len({shape.label for shape in shapes}) == len(shapes) == 56
    assert len({shape.source for shape in shapes}) == 56
    assert near_twins(shapes) == {}
    many = plan_shapes(BenchmarkOptions(creatures=len(TESTED_SPECIES) + 2))
    assert set(near_twins(many).values()) == {2}
    assert f"{many[0].label}-2" in {shape.label for shape in many}


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        ({"creatures": 0}, "needs null shapes"),
        ({"creatures": 1, "transformations": ("melting",)}, "melting"),
        ({"creatures": 1, "strengths": (0,)}, "strengths"),
        ({"creatures": 1, "poses": Path("poses")}, "without the null shapes"),
        ({"creatures": 1, "seed": -1}, "at least 0"),
    ],
)
def test_options_that_make_no_sense_are_refused(wrong: dict[str, object], reason: str) -> None:
    with pytest.raises(InvalidRequestError, match=reason):
        BenchmarkOptions(**wrong)  # type: ignore[arg-type]


def test_a_distractor_that_is_a_query_class_in_another_pose_is_left_out(
    zoo: Path, tmp_path: Path
) -> None:
    others = tmp_path / "others"
    others.mkdir()
    creature = make_creature("worm", seed=1, vertices=2000)
    order = np.random.default_rng(0).permutation(creature.rest.n_vertices)
    posed, place = creature.posed(9), np.argsort(order)
    shuffled = TriangleMesh(posed.vertices[order], place[posed.faces])
    (others / "toy.ply").write_bytes(write(shuffled, "ply"))
    stranger = make_creature("worm", seed=2, vertices=2000).rest
    (others / "stranger.ply").write_bytes(write(stranger, "ply"))
    built = build_benchmark(tiny(zoo, distractors=others), tmp_path / "out", processes=1)
    assert built.manifest["counts"]["distractors"] == 1
    assert not (tmp_path / "out" / "toy.null.0.ply").exists()
    (reason,) = [one["reason"] for one in built.manifest["left_out"] if one["file"] == "toy.ply"]
    assert "connected as those of worm" in reason
