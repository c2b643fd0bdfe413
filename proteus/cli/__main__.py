"""``python -m proteus.cli`` is ``proteus``."""

from proteus.cli.program import main

if __name__ == "__main__":
    main()
