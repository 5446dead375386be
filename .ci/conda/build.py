"""Builds and tests the conda recipe where conda-forge cannot be reached.

    pip install --target TOOLS --python-version 3.13 --only-binary=:all: py-rattler-build pip "setuptools>=77"
    ./hvi exec env PYTHONPATH=TOOLS python3 .ci/conda/build.py FOLDER

Packages of the same names stand in for conda-forge's: "python" is the environment's own Python, which has dolfinx,
PETSc and the others, "pip" and "setuptools" are those of TOOLS, and the rest are empty. So the recipe is read, solved,
built and installed, the package is imported and `hvi version` is run; only conda-forge's own builds of the requirements
are not seen. The package stays in FOLDER.
"""

from __future__ import annotations

import argparse
import platform
import re
import shutil
import sys
from importlib import metadata
from pathlib import Path

from rattler_build import Package, RenderConfig, Stage0Recipe, ToolConfiguration, VariantConfig, assemble_package

HERE = Path(__file__).parent
PYTHON = f"python{sys.version_info.major}.{sys.version_info.minor}"
CARRIED = ("pip", "setuptools")


def requirements() -> set[str]:
    """The names of all packages that the recipe asks for."""
    listed = (
        HERE.joinpath("recipe.yaml").read_text(encoding="utf-8").partition("requirements:")[2].partition("tests:")[0]
    )
    return set(re.findall(r"^    - ([\w-]+)", listed, flags=re.MULTILINE))


def version(name: str) -> str:
    """The version of a package here; conda-forge has some under other names."""
    return metadata.version({"matplotlib-base": "matplotlib", "python-gmsh": "gmsh"}.get(name, name))


def stand_in(name: str, channel: Path) -> None:
    """Put a package into a channel that has the name and version of one of conda-forge's."""
    files = channel / "files" / name
    (files / "share" / name).mkdir(parents=True)
    (files / "share" / name / "stand-in").touch()
    if name == "python":
        lead_to_our_python(files)
    if name in CARRIED:
        carry(name, files / "lib" / PYTHON / "site-packages")
    found = platform.python_version() if name == "python" else version(name)
    assemble_package(name, found, "linux-64", "0", channel / "linux-64", files_dir=files)


def lead_to_our_python(files: Path) -> None:
    """Make a virtual environment that sees the packages of the Python that runs this."""
    home = Path(sys.executable).resolve()
    (files / "bin").mkdir()
    for link in ("python", "python3", PYTHON):
        (files / "bin" / link).symlink_to(home)
    setting = f"home = {home.parent}\ninclude-system-site-packages = true\n"
    (files / "pyvenv.cfg").write_text(setting, encoding="utf-8")


def carry(name: str, folder: Path) -> None:
    """Copy the modules of a package."""
    for file in metadata.files(name) or ():
        if ".." not in file.parts:
            folder.joinpath(file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(str(file.locate()), folder / file)


def main() -> None:
    """Build the package and run its tests."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("folder", type=Path, help="a new folder")
    channel = parser.parse_args().folder.resolve()  # rattler-build makes the index of its own output folder
    (channel / "linux-64").mkdir(parents=True)
    for name in sorted(requirements()):
        stand_in(name, channel)
    (variant,) = Stage0Recipe.from_file(HERE / "recipe.yaml").render(VariantConfig(), RenderConfig())
    variant.run_build(ToolConfiguration(), output_dir=channel, channels=[channel.as_uri()])
    (file,) = (channel / "noarch").glob("hvi_fenicsx-*.conda")
    results = Package.from_file(file).run_tests(channel=[channel.as_uri()])
    for result in results:
        print(f"test {result.test_index}: {'passed' if result.success else 'FAILED'}")
        print("\n".join(result.output) if not result.success else "", end="")
    print(file)
    raise SystemExit(not all(result.success for result in results))


if __name__ == "__main__":
    main()
