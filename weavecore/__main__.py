"""``python -m weavecore`` is the command ``weavecore``."""

from weavecore.cli import main

if __name__ == "__main__":
    main()
