from collections.abc import Iterator

import pytest

from proteus.reproduction import pictures, style


@pytest.fixture(autouse=True, scope="package")
def _coarse_pictures() -> Iterator[None]:
    """Figures as small as thumbnails: what they show is tested, not how fine."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pictures, "SHEET_PIXELS", 32)
        patch.setattr(pictures, "SIGNATURE_PIXELS", 48)
        patch.setattr(style, "DPI", 40)
        yield
