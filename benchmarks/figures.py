"""``python -m benchmarks.figures``: makes the pictures of the documentation and the page anew."""

from pathlib import Path

from PIL import Image

from workers.creatures import Creature, make_creature
from workers.creatures.figure import draw_species
from workers.rendering.render import Picture, encode_png, render
from workers.transformations import TRANSFORMATIONS, transform
from workers.transformations.figure import draw_transformations

ROOT = Path(__file__).parent.parent
FIGURES = ROOT / "docs" / "figures"
CARDS = ROOT / "service" / "web" / "public" / "transformations"
CARD_SIZE = (160, 120)
POSED = ("isometry", "topology", "all")
STRENGTHS = {"noise": 3, "view": 3, "scan": 3}  # 5 where it is not said
SEEDS = {"topology": 2, "view": 2, "scan": 5}  # what is done to be seen from the front
DETAILS = {  # left, top, right, bottom of what is shown, as shares of the drawing
    "topology": (0.03, 0.3, 0.71, 0.81),
    "micro-holes": (0.42, 0.08, 0.94, 0.47),
}
SMALL = 0.4  # of the shape beside its scaled copy


def main() -> None:
    """Draw every species at rest and in a pose, and what transformations do."""
    FIGURES.mkdir(parents=True, exist_ok=True)
    _save("creatures.png", draw_species())
    human = make_creature("human", seed=3, vertices=8000)
    _save("transformations.png", draw_transformations(human.rest, pose=human.posed(1)))
    save_cards()


def save_cards() -> None:
    """Draw a horse under each transformation, small, for the page's choice of them."""
    CARDS.mkdir(parents=True, exist_ok=True)
    horse = make_creature("horse", seed=3, vertices=8000)
    for name in TRANSFORMATIONS:
        card = _card(horse, name)
        card.save(CARDS / f"{name}.webp", quality=75, alpha_quality=80, method=6)


def _card(creature: Creature, name: str) -> Image.Image:
    """Drawing of a creature under a transformation on a transparent ground."""
    made = transform(
        creature.rest,
        name,
        STRENGTHS.get(name, 5),
        seed=SEEDS.get(name, 0),
        pose=creature.posed(1) if name in POSED else None,
    )
    drawing = Image.fromarray(render(made.mesh, size=640))
    if name == "scale":
        return _beside(drawing)
    if name in DETAILS:
        left, top, right, bottom = (640 * share for share in DETAILS[name])
        return drawing.resize(CARD_SIZE, box=(left, top, right, bottom))
    return _fitted(drawing, CARD_SIZE)


def _beside(drawing: Image.Image) -> Image.Image:
    """Return the same shape twice, small and large."""
    width, height = CARD_SIZE
    small = _fitted(drawing, (round(SMALL * width * 0.8), round(SMALL * height)))
    large = _fitted(drawing, (width - small.width, height))
    card = Image.new("RGBA", CARD_SIZE)
    card.paste(small, (0, height - small.height - (height - large.height) // 2))
    card.paste(large, (small.width, 0))
    return card


def _fitted(drawing: Image.Image, size: tuple[int, int]) -> Image.Image:
    """Return what is drawn in the middle of a picture of this size, as large as it can be."""
    shown = drawing.crop(drawing.getbbox())
    scale = min(size[0] / shown.width, size[1] / shown.height)
    shown = shown.resize((round(scale * shown.width), round(scale * shown.height)))
    fitted = Image.new("RGBA", size)
    fitted.paste(shown, ((size[0] - shown.width) // 2, (size[1] - shown.height) // 2))
    return fitted


def _save(name: str, picture: Picture) -> None:
    (FIGURES / name).write_bytes(encode_png(picture, palette=256))


if __name__ == "__main__":
    main()
