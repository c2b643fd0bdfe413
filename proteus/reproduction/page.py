"""The report's page: one HTML file that needs neither network nor JavaScript."""

import base64
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from proteus.reproduction.tables import MEAN

MEDIA_TYPES = {".svg": "image/svg+xml", ".png": "image/png"}


def render(template: str, context: dict[str, Any]) -> str:
    """Return a page from a template of this package.

    Parameters
    ----------
    template : str
        Name of a file in ``templates``.
    context : dict
        The values that the template names.
    """
    return environment().get_template(template).render(context)


def environment() -> Environment:
    """Return what renders the templates: text is escaped, and an unknown name is an error."""
    found = Environment(
        loader=PackageLoader("proteus.reproduction"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.globals["mean_row"] = MEAN
    found.filters["number"] = number
    found.filters["data_url"] = data_url
    return found


def number(value: float | None, form: str) -> str:
    """Return a number with a true minus sign and without -0.0; a dash where there is none."""
    if value is None:
        return "–"
    text = form % value
    if float(text) == 0.0:
        text = form % 0.0
    return text.replace("-", "−")


def data_url(image: Path) -> str:
    """Return the URL that holds an image file itself."""
    data = base64.b64encode(image.read_bytes()).decode("ascii")
    return f"data:{MEDIA_TYPES[image.suffix]};base64,{data}"
