"""Conan 2 recipe of libclamor: conan create tools/packaging/conan --build=missing"""

import os
import re

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load, rm
from conan.tools.gnu import PkgConfigDeps
from conan.tools.system.package_manager import Apt

required_conan_version = ">=2.0"


class ClamorConan(ConanFile):
    name = "clamor"
    description = "Baked acoustics for games: streams, samples and mixes what a listener hears"
    license = "Apache-2.0"
    topics = ("audio", "acoustics", "games", "hrtf")
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"shared": [True, False]}
    default_options = {"shared": True}

    # The repository that the recipe lies in.
    def _root(self):
        return os.path.join(self.recipe_folder, "..", "..", "..")

    def set_version(self):
        header = load(self, os.path.join(self._root(), "runtime", "clamor.h"))
        parts = [re.search(rf"CLAMOR_VERSION_{part} (\d+)", header)[1]
                 for part in ("MAJOR", "MINOR", "PATCH")]
        self.version = ".".join(parts)

    def export_sources(self):
        for pattern in ("CMakeLists.txt", "LICENSE", "assets/material*", "common/*",
                        "formats/*", "runtime/*", "tools/packaging/*"):
            copy(self, pattern, self._root(), self.export_sources_folder)

    def layout(self):
        cmake_layout(self)

    def validate(self):
        check_min_cppstd(self, 20)

    def requirements(self):
        self.requires("capnproto/1.0.1")
        self.requires("embree3/3.13.5")
        self.requires("flac/1.4.2")
        self.requires("fmt/10.2.1")
        self.requires("glm/0.9.9.8")
        self.requires("highway/1.2.0")
        self.requires("libsamplerate/0.2.2")
        self.requires("libsndfile/1.2.2")
        self.requires("nlohmann_json/3.11.3")
        self.requires("onetbb/2021.10.0")
        self.requires("soxr/0.1.3")
        self.requires("tinygltf/2.9.7")
        self.requires("xxhash/0.8.2")
        self.requires("zstd/1.5.5")

    def build_requirements(self):
        self.tool_requires("capnproto/1.0.1")

    # Conan Center has no libmysofa.
    def system_requirements(self):
        Apt(self).install(["libmysofa-dev", "pkg-config"])

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["CLAMOR_PROGRAM"] = False
        toolchain.cache_variables["BUILD_TESTING"] = False
        toolchain.generate()
        CMakeDeps(self).generate()
        PkgConfigDeps(self).generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))
        unused = "libclamor.a" if self.options.shared else "libclamor.so*"
        rm(self, unused, os.path.join(self.package_folder, "lib"))

    def package_info(self):
        self.cpp_info.libs = ["clamor"]
        target = "clamor::clamor" if self.options.shared else "clamor::clamor_static"
        self.cpp_info.set_property("cmake_target_name", target)
        self.cpp_info.set_property("pkg_config_name", "clamor")
        if not self.options.shared:
            self.cpp_info.system_libs = ["mysofa", "stdc++", "m", "pthread"]
