"""What the benchmark of ingestion makes, and how it counts."""

import os
import time
from pathlib import Path

import numpy as np
import pytest

from benchmarks.ingestion import (
    STEPS,
    TINY,
    Clock,
    ingest,
    processor_seconds,
    real_files,
    shares_of_steps,
    subdivided,
    tiny_files,
)
from tests.meshes import bumpy_sphere, cylinder
from workers.geometry.formats import parse, write
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import boundary_loops, euler_characteristic


@pytest.mark.parametrize("mesh", [bumpy_sphere(2, 1), cylinder(12, 6)])
@pytest.mark.parametrize("more", [1, 100, 1000])
def test_a_subdivided_mesh_has_the_vertices_asked_for_and_the_same_surface(
    mesh: TriangleMesh, more: int
) -> None:
    finer = subdivided(mesh, mesh.n_vertices + more)
    assert finer.n_vertices == mesh.n_vertices + more
    assert finer.area == pytest.approx(mesh.area, rel=1e-12)
    assert euler_characteristic(finer) == euler_characteristic(mesh)
    assert len(boundary_loops(finer)) == len(boundary_loops(mesh))
    assert subdivided(mesh, mesh.n_vertices - 1) is mesh


def test_real_meshes_are_distinct_in_every_round(tmp_path: Path) -> None:
    data, made = tmp_path / "data", tmp_path / "made"
    data.mkdir()
    made.mkdir()
    (data / "README.md").write_text("no mesh")
    (data / "broken.off").write_text("OFF 3")
    for seed in (1, 2):
        (data / f"{seed}.off").write_bytes(write(bumpy_sphere(2, seed), "off"))
    assert [path.name for path in real_files(data, made, 2, None)] == ["1.off", "2.off"]
    files = real_files(data, made, 6, 1000)
    sizes = [parse(path.read_bytes(), filename=path.name).mesh.n_vertices for path in files]
    assert sizes == [1000, 1000, 900, 900]
    assert len({path.read_bytes() for path in files}) == 4


def test_tiny_meshes_are_tiny_and_no_two_alike(tmp_path: Path) -> None:
    files = tiny_files(tmp_path, 4)
    sizes = [parse(path.read_bytes(), filename=path.name).mesh.n_vertices for path in files]
    assert all(0.9 * TINY[0] <= size <= 1.1 * TINY[1] for size in sizes)
    assert len({path.read_bytes() for path in files}) == 4


def test_of_steps_within_each_other_the_inner_one_is_counted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = 0.0
    monkeypatch.setattr(time, "process_time", lambda: now)
    clock = Clock()

    def work(seconds: float) -> None:
        nonlocal now
        now += seconds

    inner = clock.timed("inner", lambda: work(3.0))

    def nested() -> None:
        work(1.0)
        inner()
        work(1.0)

    clock.timed("outer", nested)()
    work(5.0)
    assert clock.shares() == {"other": 0.5, "outer": 0.2, "inner": 0.3}


def test_every_step_has_its_share(tmp_path: Path) -> None:
    """A function that was renamed would have none."""
    files = []
    for seed in (1, 2):
        files.append(tmp_path / f"{seed}.off")
        files[-1].write_bytes(write(bumpy_sphere(2, seed), "off"))
    shares = shares_of_steps(files)
    assert set(shares) == {*STEPS, "other"}
    assert all(share > 0.0 for share in shares.values())
    assert sum(shares.values()) == pytest.approx(1.0)


def test_the_processor_seconds_of_this_process_are_those_it_knows() -> None:
    np.linalg.eigh(np.eye(200))
    assert processor_seconds(os.getpid()) >= 0.9 * time.process_time() - 0.02


@pytest.mark.slow
@pytest.mark.server
def test_tiny_meshes_in_a_zip_are_ingested(tmp_path: Path) -> None:
    row = ingest("tiny", tiny_files(tmp_path, 6), processes=1, sampled=2, archive=True)
    assert (row.meshes, row.failed) == (6, 0)
    assert row.processor_seconds > 0.0
    assert row.ratio is not None
