"""Recipe of polydem for Spack 1; the page of this folder says with what it was tried (src/packaging/README.md).

Put it into a repository of your own, as packages/polydem/package.py. Give the class the address of the sources, `git`,
or take a folder of sources: spack develop --path FOLDER polydem@main
"""

from spack.package import conflicts, depends_on, license, requires, variant, version  # noqa: A004
from spack_repo.builtin.build_systems.cmake import CMakePackage, generator


class Polydem(CMakePackage):
    """Discrete elements for convex polygons in two dimensions."""

    license("BSD-3-Clause")

    version("main", branch="main")

    variant("mpi", default=False, description="Compute with several processes")
    variant("precision", default="double", values=("single", "double", "quadruple"), multi=False,
            description="Working precision")

    generator("ninja")

    depends_on("c", type="build")
    depends_on("fortran", type="build")
    depends_on("cmake@3.25:", type="build")
    # Python writes sources, and the program's tab completion and man page.
    depends_on("python@3.9:", type="build")
    depends_on("hdf5@1.10.5:+fortran~mpi", when="~mpi")
    depends_on("hdf5@1.10.5:+fortran+mpi", when="+mpi")
    depends_on("openmpi@4:", when="+mpi")

    requires("%fortran=gcc@12:", msg="polydem needs gfortran 12 or newer")
    conflicts("precision=quadruple", when="+mpi", msg="quadruple precision is for runs of one process")

    def cmake_args(self):
        """Options of the configuration."""
        return [self.define_from_variant("POLYDEM_MPI", "mpi"),
                self.define_from_variant("POLYDEM_PRECISION", "precision"),
                self.define("POLYDEM_TESTS", False)]
