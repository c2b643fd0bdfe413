"""Every kind of file is read as what people mean by it, or refused with the reason."""

import pytest
from numpy.testing import assert_allclose

from tests.formats.every_kind import every_kind
from tests.formats.kinds import BODY, THE_BODY, Kind
from workers.errors import ProteusError
from workers.geometry.cleaning import CleanedMesh, clean
from workers.geometry.formats import ParsedMesh, parse
from workers.geometry.topology import boundary_loops, count_surface_components

KINDS = every_kind()
READ = [kind for kind in KINDS if kind.facts]
REFUSED = [kind for kind in KINDS if not kind.facts]


def read(kind: Kind) -> tuple[ParsedMesh, CleanedMesh]:
    parsed = parse(kind.build(), filename=kind.filename)
    return parsed, clean(parsed.mesh)


@pytest.mark.parametrize("kind", READ, ids=lambda kind: kind.name)
def test_the_mesh_is_what_people_mean_by_the_file(kind: Kind) -> None:
    _, cleaned = read(kind)
    mesh, facts = cleaned.mesh, kind.facts
    assert facts is not None
    for expected, found in (
        (facts.vertices, mesh.n_vertices),
        (facts.components, count_surface_components(mesh)),
        (facts.loops, len(boundary_loops(mesh))),
    ):
        assert expected in (None, found)
    if facts.area is not None:
        assert mesh.area == pytest.approx(facts.area, rel=facts.tolerance)
    if facts is THE_BODY:
        size = BODY.vertices.max(axis=0) - BODY.vertices.min(axis=0)
        found_size = mesh.vertices.max(axis=0) - mesh.vertices.min(axis=0)
        assert_allclose(sorted(found_size), sorted(size), rtol=1e-4)


@pytest.mark.parametrize(
    "kind", [kind for kind in READ if kind.repairs or kind.found], ids=lambda kind: kind.name
)
def test_what_was_repaired_and_left_alone_is_said(kind: Kind) -> None:
    parsed, cleaned = read(kind)
    repairs = (*parsed.repairs, *cleaned.repairs)
    for part in kind.repairs:
        assert any(part in sentence for sentence in repairs), repairs
    for part in kind.found:
        assert any(part in sentence for sentence in parsed.found), parsed.found


@pytest.mark.parametrize("kind", REFUSED, ids=lambda kind: kind.name)
def test_what_is_refused_is_refused_by_name(kind: Kind) -> None:
    with pytest.raises(ProteusError) as caught:
        read(kind)
    assert kind.reason in str(caught.value)
