# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Recipe of Spack 1.0 or later. docs/guide/containers.md says how it is used.

Sources are not fetched from anywhere: it builds a clone (`spack dev-build`, `spack develop`), or
the source archive of a release in the folder in which Spack is called. It makes no package of
Python, which wants a nanobind that Spack has not got; pip makes one.
"""

import os

from spack_repo.builtin.build_systems.cmake import CMakePackage, generator
from spack_repo.builtin.build_systems.cuda import CudaPackage

from spack.package import *


class Tetwarp(CMakePackage, CudaPackage):
    """Tetwarp deforms medical volumes (CT series in DICOM, NIfTI, NRRD, MHA) by
    fields of moved vertices, exactly: each output voxel is sampled where the one
    tetrahedron that owns it came from."""

    manual_download = True
    url = f"file://{os.getcwd()}/tetwarp-0.3.0.tar.xz"

    license("Apache-2.0")

    version("0.3.0")

    variant("dcmtk", default=True, description="DICOM series in and out")
    variant("openjpeg", default=True, when="+dcmtk", description="JPEG 2000 in DICOM")
    variant("itk", default=True, description="Transforms and filters of ITK")
    variant("vtk", default=False, description="Fields and meshes in XML files of VTK")
    variant("view", default=True, description="The viewer, tetwarp view")
    variant("shared", default=False, description="Shared libraries in the place of static ones")

    depends_on("c", type="build")
    depends_on("cxx", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("ninja", type="build")
    depends_on("git", type="build")
    depends_on("googletest", type="test")
    depends_on("python@3.9:", type="test")

    generator("ninja")

    depends_on("cli11@2.1:")
    depends_on("eigen@3.3:3")
    depends_on("glm@0.9.9.8:")
    depends_on("highway@1.0.3:")
    depends_on("libdeflate")
    depends_on("libpng")
    depends_on("minizip")
    depends_on("nlohmann-json@3.11:")
    depends_on("openssl@3:")
    depends_on("tbb")
    conflicts("^intel-tbb@:2020", msg="TBB has to be oneTBB")
    depends_on("zlib-api")

    with when("+dcmtk"):
        depends_on("dcmtk@3.6.7:+pic")
        depends_on("icu4c")
    depends_on("openjpeg@2.5", when="+openjpeg")
    with when("+itk"):
        depends_on("itk@5.2:5")
        depends_on("tomlplusplus@3.3:")
    depends_on("vtk@9:", when="+vtk")
    with when("+view"):
        depends_on("boost@1.74:")  # only headers
        depends_on("libjpeg-turbo")
    depends_on("cuda@12:", when="+cuda")

    conflicts("%gcc@:11", msg="C++20 wants GCC 12 or later")
    conflicts("%clang@:13", msg="C++20 wants clang 14 or later")

    sanity_check_is_file = ["bin/tetwarp"]

    def cmake_args(self):
        args = [
            self.define_from_variant("BUILD_SHARED_LIBS", "shared"),
            self.define_from_variant("TETWARP_WITH_CUDA", "cuda"),
            self.define_from_variant("TETWARP_WITH_DCMTK", "dcmtk"),
            self.define("TETWARP_WITH_OPENJPEG", self.spec.satisfies("+openjpeg")),
            self.define_from_variant("TETWARP_WITH_ITK", "itk"),
            self.define_from_variant("TETWARP_WITH_VTK", "vtk"),
            self.define_from_variant("TETWARP_WITH_VIEW", "view"),
            self.define("TETWARP_BUILD_APPS", True),
            self.define("TETWARP_BUILD_TESTS", self.run_tests),
            self.define("TETWARP_BUILD_EXAMPLES", False),
            self.define("TETWARP_BUILD_BENCH", False),
            self.define("TETWARP_BUILD_PYTHON", False),
        ]
        # Without them CMake compiles for the devices of this machine, or for all cards.
        if self.spec.satisfies("+cuda") and not self.spec.satisfies("cuda_arch=none"):
            args.append(
                self.define("CMAKE_CUDA_ARCHITECTURES", self.spec.variants["cuda_arch"].value)
            )
        return args

    def test_deform(self):
        """A phantom is made and deformed."""
        tetwarp = which(self.prefix.bin.tetwarp)
        tetwarp("phantom", "-o", "phantom.mha", "--size", "64,64,40", "--spacing", "6,6,9")
        tetwarp(
            "deform", "phantom.mha", "-f", "wave:amplitude=8,wavelength=96", "-o", "deformed.mha"
        )
