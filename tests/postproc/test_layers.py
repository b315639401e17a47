"""What the Python packages may import: no circle, nothing above, and the laboratory nowhere else."""

import ast
import os
from graphlib import TopologicalSorter
from pathlib import Path

import polydem_lab
import polydem_post
import pytest

SOURCES = Path(os.environ["POLYDEM_SOURCE_DIR"]) / "postproc" / "src"
LAYERS = {"polydem_post": polydem_post.LAYERS, "polydem_lab": polydem_lab.LAYERS}


def module_of(path):
    """Name of the module, or of the package, in a file."""
    parts = path.relative_to(SOURCES).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


FILES = {module_of(path): path for package in LAYERS for path in sorted((SOURCES / package).rglob("*.py"))}


def imports_of(module):
    """Our modules that a module imports, also within functions; a package in place of its names."""
    path, found = FILES[module], set()
    package = module.split(".") if path.name == "__init__.py" else module.split(".")[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else []
            source = ".".join([*base, *filter(None, [node.module])])
            names = {f"{source}.{alias.name}" for alias in node.names}
            found |= (names & set(FILES)) | ({source} if names - set(FILES) else set())
    return found & set(FILES)


IMPORTS = {module: imports_of(module) for module in FILES}


def layer_of(module):
    """Place of a module in the order of its package; the command line's own call stands above all."""
    package, _, rest = module.partition(".")
    return len(LAYERS[package]) if rest == "__main__" else LAYERS[package].index(rest.split(".")[0])


def test_every_module_is_in_a_layer():
    for package, layers in LAYERS.items():
        found = {module.split(".")[1] for module in FILES if module.startswith(package + ".")}
        assert found - {"__main__"} == set(layers)


def test_a_layer_imports_only_those_before_it():
    wrong = [(module, used) for module in FILES if "." in module for used in IMPORTS[module]
             if used.split(".")[0] == module.split(".")[0] and "." in used and layer_of(used) > layer_of(module)]
    assert wrong == []


def test_there_is_no_circle_of_imports():
    assert list(TopologicalSorter(IMPORTS).static_order())


def test_only_the_command_line_knows_the_laboratory():
    assert not [(module, used) for module in FILES if module.startswith("polydem_post")
                for used in IMPORTS[module] if used.startswith("polydem_lab")]
    telling = [module for module, path in FILES.items() if module.startswith("polydem_post.")
               and "polydem_lab" in path.read_text(encoding="utf-8")]
    assert telling == ["polydem_post.command_line.main"]


@pytest.mark.parametrize("package", LAYERS)
def test_imports_are_found(package):
    assert sum(bool(IMPORTS[module]) for module in FILES if module.startswith(package)) > 20
