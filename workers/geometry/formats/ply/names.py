"""What the names of PLY's elements and properties mean, whoever wrote them."""

from workers.errors import InvalidMeshError
from workers.geometry.formats.rows.tables import Element

ELEMENTS = {
    "vertex": {"vertex", "vertices", "vertexes", "vert", "verts", "point", "points"},
    "face": {"face", "faces", "facet", "facets", "polygon", "polygons", "triangle", "triangles"},
    "tristrips": {"tristrips", "tristrip", "tri_strips", "tri_strip", "triangle_strips", "strips"},
    "range_grid": {"range_grid"},
}
AXES = (
    ("x", "y", "z"),
    ("px", "py", "pz"),
    ("pos_x", "pos_y", "pos_z"),
    ("posx", "posy", "posz"),
    ("vx", "vy", "vz"),
)
CORNERS = ("vertex_indices", "vertex_index", "vertex_indexes", "vertexindices", "indices")
MEANINGS = {
    "colours": {"red", "green", "blue", "r", "g", "b", "diffuse_red", "rgb", "rgba", "alpha"},
    "normals": {"nx", "ny", "nz", "normal_x"},
    "texture coordinates": {"s", "t", "u", "v", "texture_u", "texture_v", "texcoord", "texcoords"},
    "quality": {"quality", "confidence", "intensity", "value"},
}
SPLATS = {"f_dc_0", "opacity", "scale_0", "rot_0"}
MOST_NAMES = 8


def axes_of(element: Element) -> list[int]:
    """Find the three coordinates.

    Parameters
    ----------
    element : Element
        The vertices.

    Returns
    -------
    list of int
        Places of three properties.

    Raises
    ------
    InvalidMeshError
        There are none; the message names the properties that there are.
    """
    scalars = {
        p.name: i for i, p in reversed([*enumerate(element.properties)]) if not p.length_type
    }
    for axes in AXES:
        if set(axes) <= set(scalars):
            return [scalars[axis] for axis in axes]
    raise InvalidMeshError(
        f"PLY's vertices have the properties {_names(element)}; expected x, y and z"
    )


def corners_of(element: Element) -> int:
    """Find the list that holds vertex indices.

    Parameters
    ----------
    element : Element
        The faces, or triangle strips.

    Returns
    -------
    int
        Place of the property: of the usual name, or the only list of integers.

    Raises
    ------
    InvalidMeshError
        There is none, or more than one; the message names the properties that there are.
    """
    lists = {p.name: i for i, p in reversed([*enumerate(element.properties)]) if p.length_type}
    for name in CORNERS:
        if name in lists:
            return lists[name]
    of_integers = [i for i in lists.values() if element.properties[i].type[0] != "f"]
    if len(of_integers) == 1:
        return of_integers[0]
    raise InvalidMeshError(
        f"PLY's element '{element.name}' has the properties {_names(element)}; "
        "expected one list 'vertex_indices'"
    )


def holds_splats(elements: tuple[Element, ...]) -> bool:
    """Tell whether the vertices are Gaussian splats.

    Parameters
    ----------
    elements : tuple of Element
        All of the file.

    Returns
    -------
    bool
        Whether they have the properties that such files have.
    """
    return any({p.name for p in e.properties} >= SPLATS for e in elements if e.name == "vertex")


def what_else(elements: tuple[Element, ...], comments: tuple[str, ...]) -> tuple[str, ...]:
    """Name what the file holds besides the surface.

    Parameters
    ----------
    elements : tuple of Element
        All of the file.
    comments : tuple of str
        Of the header; programs name textures there.

    Returns
    -------
    tuple of str
        In short, for people: "vertex colours".
    """
    found = []
    for name in ("vertex", "face"):
        names = {p.name for e in elements if e.name == name and e.count for p in e.properties}
        found += [f"{name} {what}" for what, words in MEANINGS.items() if names & words]
    n_textures = sum(comment.lower().startswith("texturefile") for comment in comments)
    if n_textures:
        found.append(f"{n_textures} texture{'s' if n_textures > 1 else ''}")
    others = [e.name[:24] for e in elements if e.count and e.name not in ELEMENTS]
    found += [f"elements '{name}'" for name in others[:MOST_NAMES]]
    return tuple(dict.fromkeys(found))


def _names(element: Element) -> list[str]:
    """Names of the first properties."""
    return [p.name[:24] for p in element.properties[:MOST_NAMES]]
