# r: numpy>=1.26
# r: scipy>=1.12
# venv: weavecore
import platform
import sys
from importlib.util import find_spec
from pathlib import Path

# Rhino writes its own names of types into the signature of RunScript, and looks them up in these modules.
import Grasshopper
import Rhino
import scriptcontext
import System
import System.Collections.Generic

# Unless it is installed, weavecore lies in a folder of the package, or beside the user objects.
if find_spec("weavecore") is None:
    homes = [folder.FullName for folder in Rhino.Runtime.HostUtils.GetActivePlugInVersionFolders()]
    homes.append(Grasshopper.Folders.DefaultUserObjectFolder)
    libraries = [library for home in homes for library in Path(home).glob("weavecore_library")]
    sys.path += [str(path) for library in libraries for path in (library, library / platform.machine().lower())]
