"""``python -m benchmarks.figures``: makes the pictures of the documentation anew."""

from pathlib import Path

from workers.geometry.creatures import make_creature
from workers.geometry.creatures.figure import draw_species
from workers.geometry.rendering import Picture, encode_png
from workers.geometry.transformations.figure import draw_transformations

FIGURES = Path(__file__).parent.parent / "docs" / "figures"


def main() -> None:
    """Draw every species at rest and in a pose, and a human under all transformations."""
    FIGURES.mkdir(parents=True, exist_ok=True)
    _save("creatures.png", draw_species())
    human = make_creature("human", seed=3, vertices=8000)
    _save("transformations.png", draw_transformations(human.rest, pose=human.posed(1)))


def _save(name: str, picture: Picture) -> None:
    (FIGURES / name).write_bytes(encode_png(picture, palette=256))


if __name__ == "__main__":
    main()
