"""``python -m service.cli`` is ``proteus``."""

from service.cli.program import main

if __name__ == "__main__":
    main()
