"""``python -m benchmarks.figures``: makes the pictures of the documentation anew."""

from pathlib import Path

from workers.geometry.creatures.figure import draw_species
from workers.geometry.rendering import encode_png

FIGURES = Path(__file__).parent.parent / "docs" / "figures"


def main() -> None:
    """Draw every species at rest and in a pose."""
    FIGURES.mkdir(parents=True, exist_ok=True)
    (FIGURES / "creatures.png").write_bytes(encode_png(draw_species(), palette=256))


if __name__ == "__main__":
    main()
