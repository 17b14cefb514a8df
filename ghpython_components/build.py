"""Build the Grasshopper plugin: ``python ghpython_components/build.py -o FOLDER``.

Writes a ``.ghuser`` file for each component, the definition ``weave_workflow`` as ``.gh`` and ``.ghx``, three smaller
ones, and the package for Rhino's package manager, which brings the Python package weavecore along.  With
``--wheels FOLDER`` it brings the wheels of NumPy and SciPy in that folder too, and its scripts ask Rhino to install
nothing.  No Rhino is needed, and the same sources give the same bytes.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from grasshopper_files.archive import encode_archive
from grasshopper_files.components import encode_user_object, read_components, without_requirements
from grasshopper_files.definition import NAME, definition
from grasshopper_files.examples import EXAMPLES, example
from grasshopper_files.library import library_files, system_of
from grasshopper_files.package import encode_package
from grasshopper_files.xml_archive import encode_xml

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
SAMPLE = ROOT / "sample_files" / "hourglass.3dm"
"""The surface that the definition holds: its rods cross and bend without a warning."""


def version() -> str:
    """The version of weavecore in this checkout."""
    text = (ROOT / "pyproject.toml").read_text("utf-8")
    return re.search(r'^version = "(.+)"$', text, re.MULTILINE)[1]  # type: ignore[index]


def sample(name: str = SAMPLE.name) -> Any:
    """The rhino3dm mesh of a sample file."""
    import rhino3dm

    path = SAMPLE.with_name(name)
    model = rhino3dm.File3dm.Read(str(path))
    if model is None:
        raise FileNotFoundError(f"{path} is missing or damaged: python sample_files/make.py writes it again")
    return model.Objects[0].Geometry


def build(wheels: Sequence[Path] = ()) -> dict[str, bytes]:
    """All files of the plugin by their names, with the wheels of NumPy and SciPy that the package is to bring along."""
    components = [without_requirements(one) if wheels else one for one in read_components(HERE)]
    objects = {f"{one.folder}.ghuser": encode_user_object(one) for one in components}
    by_folder = {one.folder: one for one in components}
    workflow = definition(by_folder, sample())
    definitions = {f"{name}.gh": encode_archive(example(name, by_folder, sample)) for name in EXAMPLES}
    definitions[f"{NAME}.gh"] = encode_archive(workflow)
    extras = {
        **{f"misc/{name}": content for name, content in definitions.items()},
        "misc/LICENSE": (ROOT / "LICENSE").read_bytes(),
        "misc/README.md": (ROOT / "docs" / "grasshopper.md").read_bytes(),
    }
    icon = (HERE / "package_icon.png").read_bytes()
    library = library_files(ROOT / "weavecore", version(), wheels)
    package = encode_package(version(), icon, {**objects, **extras, **library})
    definitions[f"{NAME}.ghx"] = encode_xml(workflow)
    return {**objects, **definitions, f"weavecore-{version()}-rh8-{system_of(wheels)}.yak": package}


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the plugin into a folder."""
    parser = argparse.ArgumentParser(description="Build the Grasshopper plugin.")
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="FOLDER", help="where the files go")
    parser.add_argument("--wheels", type=Path, metavar="FOLDER", help="wheels of NumPy and SciPy to bring along")
    given = parser.parse_args(arguments)
    folder = given.out
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in build(sorted(given.wheels.glob("*.whl")) if given.wheels else ()).items():
        (folder / name).write_bytes(content)
        print(f"{name}: {len(content):,} bytes")


if __name__ == "__main__":
    main()
