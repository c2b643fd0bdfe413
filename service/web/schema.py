"""The page's types of what the service answers, generated from its OpenAPI document.

``src/api/schema.ts`` is written by ``python -m service.web --types``, without a running service,
and is checked in: building the page needs no generator. ``--check`` fails where it differs.
"""

import json
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from service.web import node

FOLDER = Path(__file__).parent
GENERATOR = FOLDER / "types"
TYPES = FOLDER / "src" / "api" / "schema.ts"
LEFT_OUT = frozenset({"examples", "example"})
"""What of a schema is no type: the examples are nine tenths of the document."""


class OutdatedTypesError(Exception):
    """The page's types are not those of the service."""


def write_types() -> None:
    """Write the types of the service as it is."""
    TYPES.write_text(generate(), encoding="utf-8")


def check_types() -> None:
    """Compare the types with the service as it is.

    Raises
    ------
    OutdatedTypesError
        They differ.
    """
    found = TYPES.read_text(encoding="utf-8") if TYPES.is_file() else ""
    if found != generate():
        raise OutdatedTypesError(
            f"{TYPES.relative_to(FOLDER)} differs from the service's OpenAPI document; "
            "python -m service.web --types writes it"
        )


def generate() -> str:
    """Return the types in TypeScript, the same for the same schemas.

    Raises
    ------
    CalledProcessError
        The generator could not be installed, or failed.
    """
    node.install(GENERATOR)
    program = GENERATOR / "node_modules" / "openapi-typescript" / "bin" / "cli.js"
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "openapi.json"), Path(folder, "schema.ts")
        source.write_text(json.dumps(schemas()))
        command = [str(node.PROGRAM), str(program), str(source), "--output", str(target)]
        subprocess.run(command, cwd=GENERATOR, check=True, capture_output=True)
        return target.read_text(encoding="utf-8")


def schemas() -> dict[str, Any]:
    """Return an OpenAPI document with the schemas of the service's, and without paths."""
    from service.app import create_app
    from workers.settings import Settings

    whole = create_app(Settings()).openapi()
    kept = {name: without_examples(found) for name, found in whole["components"]["schemas"].items()}
    return {
        "openapi": whole["openapi"],
        "info": whole["info"],
        "paths": {},
        "components": {"schemas": kept},
    }


def without_examples(schema: Any) -> Any:
    """Return a schema without examples; a property may still be called so."""
    if isinstance(schema, list):
        return [without_examples(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    named = {"properties", "$defs"}
    return {
        key: {name: without_examples(item) for name, item in value.items()}
        if key in named and isinstance(value, dict)
        else without_examples(value)
        for key, value in schema.items()
        if key not in LEFT_OUT
    }
