"""Who may import whom: a layer imports only what stands to its left in docs/architecture.md."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "restir_engine"

# Left to right. Names are modules or packages of restir_engine; `operators` and `ui` stand beside it.
LAYERS = (
    {"requirements", "warning_log"},
    {"embree"},
    {"kernels"},
    {"scene"},
    {
        "context",
        "options",
        "settings",
        "reuse_settings",
        "film",
        "adaptive",
        "baking",
        "denoise",
        "presets",
        "pace",
        "upscale",
    },
    {"integrators"},
    {"session", "live_session"},
    {"properties", "sync", "engine", "render_job", "viewport", "background", "farm"},
    {"operators", "ui"},
)
RANK = {name: rank for rank, names in enumerate(LAYERS) for name in names}
NEEDS_BPY = RANK["properties"]
BLENDER = {"bpy", "bpy_extras", "mathutils", "gpu", "gpu_extras", "bl_ui", "addon_utils"}
SOURCES = sorted(path for folder in ("restir_engine", "operators", "ui") for path in (ROOT / folder).rglob("*.py"))


def layer_of(path: Path) -> str:
    """The layer that a file belongs to."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return parts[1] if parts[0] == "restir_engine" else parts[0]


def imports(path: Path) -> list[tuple[str, ast.stmt]]:
    """(module, statement) for every import of a file, relative ones as dotted names from the repository's root."""
    found = []
    base = path.relative_to(ROOT).with_suffix("").parts
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found += [(alias.name, node) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            prefix = ".".join(base[: len(base) - node.level]) if node.level else ""
            module = ".".join(part for part in (prefix, node.module) if part)
            known_package = (ROOT / module.replace(".", "/")).is_dir()
            found += [(f"{module}.{alias.name}" if known_package else module, node) for alias in node.names]
    return found


@pytest.mark.parametrize(
    "path", [p for p in SOURCES if p != PACKAGE / "__init__.py"], ids=lambda p: str(p.relative_to(ROOT))
)
def test_imports_only_what_stands_to_the_left(path):
    layer = layer_of(path)
    assert layer in RANK, f"{path.name} belongs to no layer"
    for module, node in imports(path):
        first, _, rest = module.partition(".")
        if first in BLENDER:
            assert RANK[layer] >= NEEDS_BPY, f"line {node.lineno}: {layer} imports {module}"
        target = rest.split(".")[0] if first == "restir_engine" else first
        if target in RANK:
            assert RANK[target] <= RANK[layer], f"line {node.lineno}: {layer} imports {module}"


# Rooms of integrators/, left to right; what stands beside them (base, the rooms of PATH) they may all import.
ROOMS = ("resampling", "techniques", "restir")


@pytest.mark.parametrize(
    "path",
    [p for room in ROOMS for p in sorted((PACKAGE / "integrators" / room).rglob("*.py"))],
    ids=lambda p: str(p.relative_to(PACKAGE)),
)
def test_resampling_knows_no_technique_and_techniques_no_frame(path):
    """What is written once for all techniques imports none of them, and nothing of lights."""
    room = path.relative_to(PACKAGE / "integrators").parts[0]
    for module, node in imports(path):
        parts = module.split(".")
        if parts[:2] == ["restir_engine", "integrators"] and parts[2] in ROOMS:
            assert ROOMS.index(parts[2]) <= ROOMS.index(room), f"line {node.lineno}: {room} imports {module}"
        if room == "resampling":
            assert parts[:3] != ["restir_engine", "kernels", "lights"], f"line {node.lineno}: imports {module}"


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*.py")), ids=lambda p: str(p.relative_to(ROOT)))
def test_package_imports_itself_relatively(path):
    """The package is `restir_engine` in tests and `bl_ext.….restir_engine.restir_engine` when installed."""
    for node in ast.walk(ast.parse(path.read_text())):
        names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom):
            assert node.level <= len(path.relative_to(PACKAGE).parts), f"line {node.lineno} leaves the package"
            names = [node.module] if node.level == 0 else []
        assert not any((name or "").split(".")[0] == "restir_engine" for name in names), f"line {node.lineno}"


# What a folder must not import: tests and benchmarks stand on `testing`, and not on each other.
APART = {
    "restir_engine": {"testing", "tests", "benchmarks"},
    "operators": {"testing", "tests", "benchmarks"},
    "ui": {"testing", "tests", "benchmarks"},
    "testing": {"tests", "benchmarks"},
    "benchmarks": {"tests"},
    "tests": {"tests", "benchmarks"},
}
ALL_SOURCES = sorted(path for folder in APART for path in (ROOT / folder).rglob("*.py"))
LOCAL = {path.stem for path in (ROOT / "tests").rglob("*.py")}


@pytest.mark.parametrize("path", ALL_SOURCES, ids=lambda p: str(p.relative_to(ROOT)))
def test_nothing_stands_on_tests(path):
    folder = path.relative_to(ROOT).parts[0]
    for module, node in imports(path):
        first = module.split(".")[0]
        assert first not in APART[folder] and first not in LOCAL, f"line {node.lineno}: {folder} imports {module}"
    added = [n for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Attribute) and n.attr == "path"]
    assert not any(isinstance(n.value, ast.Name) and n.value.id == "sys" for n in added), "sys.path is left alone"


def test_versions_of_wheels_are_those_of_the_development_install():
    import tomllib

    from restir_engine.requirements import WHEELS

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    pinned = dict(item.split("==") for item in project["dependencies"] if "==" in item)
    assert {name: version for name, version in WHEELS.items() if name in pinned} == pinned
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text())
    assert manifest["version"] == project["version"]
