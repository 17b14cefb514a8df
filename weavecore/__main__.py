"""``python -m weavecore`` is the command ``weavecore``."""

import sys
from pathlib import Path

# For -m Python puts the current folder first on its search path, where modules beside an input file would be found.
if not getattr(sys.flags, "safe_path", False) and sys.path[0] and Path(sys.path[0]) == Path.cwd():
    del sys.path[0]

from weavecore.cli import main

if __name__ == "__main__":
    main()
