import json
import os
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from proteus.cli.demo_shapes import (
    DEFORMATIONS,
    IN_ANOTHER_POSE,
    DemoMesh,
    demo_queries,
    demo_shapes,
    write_meshes,
)
from proteus.cli.program import app
from service.supervisor.lock import holder_of
from workers.creatures import SPECIES
from workers.geometry.formats import parse


def test_demo_asks_for_creatures_that_are_in_the_collection() -> None:
    shapes, queries = demo_shapes(), demo_queries()
    assert {shape.species for shape in shapes} == set(SPECIES)
    assert len({shape.path for shape in shapes}) == len(shapes) >= 60
    assert len({query.species for query in queries}) == len(queries) >= 10
    assert {query.deformation for query in queries} == set(DEFORMATIONS)
    assert {query.creature for query in queries} <= {shape.creature for shape in shapes}
    for query in queries:
        stored = {shape.pose for shape in shapes if shape.creature == query.creature}
        assert (query.pose in stored) == (query.deformation != IN_ANOTHER_POSE)


def test_question_is_the_same_each_time_and_no_copy_of_the_shape() -> None:
    stored = DemoMesh("worm", 1, 1).make()
    for deformation in DEFORMATIONS:
        pose = 7 if deformation == IN_ANOTHER_POSE else 1
        query = DemoMesh("worm", 1, pose, deformation)
        one, two = query.make(), query.make()
        assert np.array_equal(one.vertices, two.vertices)
        assert np.array_equal(one.faces, two.faces)
        assert not np.array_equal(one.vertices, stored.vertices)


def test_meshes_are_written_once(tmp_path: Path) -> None:
    meshes = [DemoMesh("worm", 1, 1), DemoMesh("worm", 1, 2)]
    assert list(write_meshes(meshes, tmp_path, processes=2)) == [0, 2]
    assert list(write_meshes(meshes, tmp_path, processes=2)) == [2]
    content = (tmp_path / meshes[0].path).read_bytes()
    assert parse(content).mesh.n_vertices == meshes[0].make().n_vertices
    assert not list(tmp_path.rglob("*.part"))


def test_creatures_are_written_with_a_sheet_of_pictures(tmp_path: Path) -> None:
    sheet = tmp_path / "sheet.png"
    result = CliRunner().invoke(
        app,
        ["creatures", str(tmp_path), "-s", "worm", "--poses", "2", "--sheet", str(sheet), "--json"],
    )
    assert result.exit_code == 0, result.output
    files = [Path(name) for name in json.loads(result.stdout)["files"]]
    assert [file.relative_to(tmp_path).as_posix() for file in files] == [
        "worm/worm-01-01.ply",
        "worm/worm-01-02.ply",
    ]
    one, two = (parse(file.read_bytes()).mesh for file in files)
    assert np.array_equal(one.faces, two.faces)  # one individual: one vertex order
    assert sheet.read_bytes().startswith(b"\x89PNG")


def test_unknown_species_is_named(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["creatures", str(tmp_path), "-s", "unicorn"])
    assert result.exit_code == 1
    assert "'unicorn'" in result.stderr


@pytest.mark.slow
def test_small_demo_with_the_real_service_finds_every_creature(
    tmp_path: Path, short_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in os.environ if name.startswith("PROTEUS_")]:
        monkeypatch.delenv(name)
    monkeypatch.setattr("proteus.cli.demo_shapes.SPECIES", ("horse", "chair", "octopus"))
    monkeypatch.setattr("proteus.cli.demo_shapes.SHAPES", 5)
    monkeypatch.setattr("proteus.cli.demo_shapes.QUERIES", 3)
    monkeypatch.setenv("TMPDIR", str(short_folder))
    arguments = ["demo", "--exit", "--json", "--port", "0", "--data-dir", str(tmp_path / "data")]
    for _ in range(2):  # the second reuses what the first has made
        result = CliRunner().invoke(app, arguments)
        assert result.exit_code == 0, result.output
        document = json.loads(result.stdout)
        assert document["passed"]
        assert len(document["queries"]) == 3
        assert {query["result"]["searched"] for query in document["queries"]} == {5}
    assert holder_of(tmp_path / "data") is None
