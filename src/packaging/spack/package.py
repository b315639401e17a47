"""Recipe of polydem for Spack. Untested: it was not built, only linted.

Put it into a repository of your own, as packages/polydem/package.py, and add the address of the sources: `git`, or
`url` with versions by their checksums.
"""

from spack.package import conflicts, depends_on, generator, license, variant, version  # noqa: A004
from spack_repo.builtin.build_systems.cmake import CMakePackage


class Polydem(CMakePackage):
    """Discrete elements for convex polygons in two dimensions."""

    license("BSD-3-Clause")

    version("main", branch="main")

    variant("mpi", default=False, description="Compute with several processes")
    variant("precision", default="double", values=("single", "double", "quadruple"), multi=False,
            description="Working precision")

    depends_on("c", type="build")
    depends_on("fortran", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("ninja", type="build")
    depends_on("python@3.9:", type="build")
    depends_on("hdf5@1.10.5:+fortran~mpi", when="~mpi")
    depends_on("hdf5@1.10.5:+fortran+mpi", when="+mpi")
    depends_on("openmpi@4:", when="+mpi")

    conflicts("%gcc@:11", msg="polydem needs gfortran 12 or newer")
    conflicts("%clang", msg="polydem needs gfortran")
    conflicts("%oneapi", msg="polydem needs gfortran")
    conflicts("precision=quadruple", when="+mpi", msg="quadruple precision is for runs of one process")

    generator("ninja")

    def cmake_args(self):
        """Options of the configuration."""
        return [self.define_from_variant("POLYDEM_MPI", "mpi"),
                self.define_from_variant("POLYDEM_PRECISION", "precision"),
                self.define("POLYDEM_TESTS", False)]
