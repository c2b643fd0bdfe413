"""Cleaned meshes become working meshes: the steps of a view, run in their order."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from workers.errors import InvalidMeshError
from workers.geometry.cleaning import FEWEST_FACES, without_useless_faces
from workers.geometry.closing import close_loops, double
from workers.geometry.mesh import TriangleMesh
from workers.geometry.refinement import refine
from workers.geometry.simplification import simplify
from workers.geometry.smoothing import fair, fair_rough, smooth
from workers.geometry.views import Step, View

WORTH_COARSENING = 2.0  # times that size: below, a second simplification costs what it saves


@dataclass(frozen=True, eq=False)
class PreparedMesh:
    """The working mesh of a view, and what each step reports."""

    mesh: TriangleMesh
    notes: tuple[str, ...]


def prepare(mesh: TriangleMesh, view: View) -> PreparedMesh:
    """Working mesh of a cleaned mesh.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean.
    view : View
        Its steps run in their order.

    Returns
    -------
    PreparedMesh
        With the mesh itself if no step has anything to do.

    Raises
    ------
    InvalidMeshError
        A step left fewer than 4 faces, since the shape is too thin for the view, or the mesh
        cannot be simplified.
    SpectrumError
        A simplification could not be checked.
    """
    return Preparation(mesh).under(view)


class Preparation:
    """Working meshes of one cleaned mesh: a step that views share runs once on the same mesh.

    A step that leaves a mesh as it is makes no difference to what comes after it.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean.
    """

    def __init__(self, mesh: TriangleMesh) -> None:
        """Nothing is done yet."""
        self._mesh = mesh
        # By the identity of the mesh before, which is kept so that no other mesh gets it.
        self._after: dict[tuple[int, Step], tuple[TriangleMesh, PreparedMesh]] = {}

    def under(self, view: View) -> PreparedMesh:
        """Prepare the mesh as a view says; see `prepare`.

        Parameters
        ----------
        view : View
            Its steps run in their order, but for those that ran before.

        Returns
        -------
        PreparedMesh
            The same as if nothing had run before.
        """
        mesh, notes = self._mesh, list[str]()
        for step in view.steps:
            key = id(mesh), step
            if key not in self._after:
                self._after[key] = mesh, _run(step, mesh, view)
            _, done = self._after[key]
            mesh = done.mesh
            notes += done.notes
        return PreparedMesh(mesh, tuple(notes))


def _run(step: Step, before: TriangleMesh, view: View) -> PreparedMesh:
    """Take one step further; notes are of this step alone."""
    mesh, said = _STEPS[step.name](before, step.parameters)
    if mesh is not before:
        mesh = without_useless_faces(mesh)
    if mesh.n_faces < min(FEWEST_FACES, before.n_faces):  # a component may have fewer
        raise InvalidMeshError(
            f"step {step.name!r} of the view {view.name!r} left {mesh.n_faces} of "
            f"{before.n_faces:,} faces with area, expected at least {FEWEST_FACES}: the shape "
            "is too thin"
        )
    return PreparedMesh(mesh, tuple(f"{step.name}: {told}" for told in said))


_Outcome = tuple[TriangleMesh, tuple[str, ...]]


def _close(mesh: TriangleMesh, parameters: Mapping[str, float]) -> _Outcome:
    """Run the step "cap-holes"."""
    closed = close_loops(mesh, longest=parameters["longest"])
    added = closed.n_faces - mesh.n_faces
    return closed, (f"added {added:,} faces",) if added else ()


def _refine(mesh: TriangleMesh, parameters: Mapping[str, float]) -> _Outcome:
    """Run the step "refine"."""
    refined = refine(mesh, vertices=int(parameters["vertices"]))
    if refined is mesh:
        return mesh, ()
    return refined, (f"{mesh.n_vertices:,} vertices made {refined.n_vertices:,}",)


def _simplify(mesh: TriangleMesh, parameters: Mapping[str, float]) -> _Outcome:
    """Run the step "simplify"."""
    simplified = simplify(mesh, vertices=int(parameters["vertices"]))
    if simplified.mesh is mesh:
        return mesh, simplified.checked
    sentence = f"{mesh.n_vertices:,} vertices made {simplified.mesh.n_vertices:,}"
    return simplified.mesh, (*simplified.checked, sentence)


def _coarsen(mesh: TriangleMesh, parameters: Mapping[str, float]) -> _Outcome:
    """Run the step "coarsen": simplify what has more than twice the vertices."""
    if mesh.n_vertices <= WORTH_COARSENING * parameters["vertices"]:
        return mesh, ()
    return _simplify(mesh, parameters)


def _fair(mesh: TriangleMesh, parameters: Mapping[str, float]) -> _Outcome:
    """Run the step "fair"."""
    return fair(mesh, time=parameters["time"]), ()


def _fair_rough(mesh: TriangleMesh, parameters: Mapping[str, float]) -> _Outcome:
    """Run the step "fair-rough"."""
    time, clean, rough = (parameters[name] for name in ("time", "clean", "rough"))
    return fair_rough(mesh, time=time, clean=clean, rough=rough), ()


def _smooth(mesh: TriangleMesh, parameters: Mapping[str, float]) -> _Outcome:
    """Run the step "smooth"."""
    return smooth(mesh, time=parameters["time"], steps=int(parameters["steps"])), ()


def _double(mesh: TriangleMesh, parameters: Mapping[str, float]) -> _Outcome:
    """Run the step "double"."""
    doubled = double(mesh, longest=parameters["longest"])
    added = doubled.n_vertices - mesh.n_vertices
    return doubled, (f"mirrored {added:,} vertices",) if added else ()


_STEPS: Mapping[str, Callable[[TriangleMesh, Mapping[str, float]], _Outcome]] = MappingProxyType(
    {
        "cap-holes": _close,
        "coarsen": _coarsen,
        "double": _double,
        "fair": _fair,
        "fair-rough": _fair_rough,
        "refine": _refine,
        "simplify": _simplify,
        "smooth": _smooth,
    }
)
