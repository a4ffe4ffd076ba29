"""What compiled code was made from: a digest of a module's source and of every module of this package it imports.

Numba itself notices a change in the file that defines a function, not in the files of the functions it calls.
"""

import hashlib
import re
import sys
from collections.abc import Iterable
from functools import cache
from pathlib import Path

# The import name: "restir_engine", or below that of an extension, which depends on the repository it is installed in.
PACKAGE = __package__.rsplit(".", 2)[0]
ROOT = Path(__file__).resolve().parents[2]

_FROM = re.compile(r"^[ \t]*from[ \t]+(\.+)([\w.]*)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)", re.MULTILINE)


def relative(module: str) -> str:
    """The dotted name of a module of this package without the package's; others keep theirs."""
    return module.removeprefix(PACKAGE + ".")


def name_of(function) -> str:
    """What a function of this package is called, whatever the package is called."""
    return f"{relative(function.__module__)}:{function.__qualname__}"


@cache
def digest(module: str) -> bytes:
    """32 bytes that change with the source of `module` (its dotted name) and of what it imports, at any depth."""
    path = ROOT.joinpath(*relative(module).split(".")).with_suffix(".py")
    if module.startswith(PACKAGE + ".") and path.exists():
        return _together(sorted(dependencies(path)))
    # A test's own kernels: they may use any of ours.
    return hashlib.sha256(_digest_of(Path(sys.modules[module].__file__)) + digest_of_all()).digest()


@cache
def digest_of_all() -> bytes:
    """The same of all modules that define compiled code."""
    return _together(path for name in ("kernels", "integrators") for path in sorted((ROOT / name).rglob("*.py")))


def _together(paths: Iterable[Path]) -> bytes:
    return hashlib.sha256(b"".join(map(_digest_of, paths))).digest()


@cache
def _digest_of(path: Path) -> bytes:
    return hashlib.sha256(path.read_bytes()).digest()


def dependencies(start: Path) -> set[Path]:
    """`start` and every module of this package that it imports, at any depth."""
    found: set[Path] = set()
    todo = [start]
    while todo:
        path = todo.pop()
        if path not in found:
            found.add(path)
            todo.extend(imports(path))
    return found


@cache
def imports(path: Path) -> tuple[Path, ...]:
    """The files that the relative imports of a file name; found by a pattern, as parsing takes thirty times longer."""
    files, result = _files(), []
    parts = path.relative_to(ROOT).parts
    for dots, module, names in _FROM.findall(path.read_text("utf-8")):
        base = ".".join([*parts[: len(parts) - len(dots)], *filter(None, [module])])
        found = [name.split()[0] for name in re.sub(r"#.*", "", names).strip("()").split(",") if name.strip()]
        named = (files.get(name) for name in [base, *(f"{base}.{name}" if base else name for name in found)])
        result += [file for file in named if file is not None and file != path]
    return tuple(result)


@cache
def _files() -> dict[str, Path]:
    """The files of this package's modules, by their dotted names without the package's own."""
    found = {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in ROOT.rglob("*.py")}
    return {name.removesuffix("__init__").removesuffix("."): path for name, path in found.items()}
