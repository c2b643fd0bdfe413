"""Which version of Proteus is installed."""

from importlib.metadata import PackageNotFoundError, version

DISTRIBUTION = "proteus-shapes"


def program_version() -> str:
    """Return the version of Proteus that is installed."""
    try:
        return version(DISTRIBUTION)
    except PackageNotFoundError:
        return "not installed"
