"""The kinds of files that the tests build, made of another body."""

from collections.abc import Iterator

import tests.formats.kinds
from tests.formats.kinds import Kind
from workers.geometry.mesh import TriangleMesh


def kinds_of(body: TriangleMesh) -> Iterator[tuple[Kind, bytes]]:
    """Yield each kind with a file of this body; those that need their own are left out.

    To be called before anything imports the modules that build, and once in a process: they take
    the body when they are imported.
    """
    tests.formats.kinds.BODY = body
    from tests.formats.every_kind import every_kind

    for kind in every_kind():
        try:
            yield kind, kind.build()
        except Exception:  # a builder that cannot do with this body
            continue
