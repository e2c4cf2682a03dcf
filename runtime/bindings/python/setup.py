"""Puts the headers, which the package reads, into what pip installs."""
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py


class BuildWithHeaders(build_py):
    def run(self):
        super().run()
        for header in "runtime/clamor.h", "bake/clamor_bake.h":
            self.copy_file(str(Path(__file__).resolve().parents[3] / header),
                           str(Path(self.build_lib) / "clamor"))


setup(cmdclass={"build_py": BuildWithHeaders})
