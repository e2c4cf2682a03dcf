#!/usr/bin/env python3
"""Packs the add-on into a zip file that Blender installs.

example: python3 formats/blender/package.py clamor_blender.zip
"""

import sys
import zipfile
from pathlib import Path

_NAME = "clamor_blender"  # not `clamor`, which is the module of Clamor's Python package


def write_package(path: Path) -> None:
    here = Path(__file__).resolve().parent
    files = [file for file in sorted(here.glob("*.py")) if file.name != "package.py"]
    root = here.parents[1]
    files += [here / "README.md", root / "LICENSE", root / "assets" / "materials.json"]
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as package:
        for file in files:
            package.write(file, f"{_NAME}/{file.name}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    write_package(Path(sys.argv[1]))
