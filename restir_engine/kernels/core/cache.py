"""Where compiled kernels are kept on disk.

Numba notices a change in the file that defines a function, not in the files of the functions it calls. So each
module's cache folder is named by a digest of its own source, of every kernel module it imports (however
indirectly), of numba's version and of the package's import name (the same kernels under two import names in
one folder raise ModuleNotFoundError when loaded).
"""

import ast
import contextlib
import hashlib
import os
import shutil
import sys
import time
from functools import cache
from pathlib import Path

import numba

_PACKAGE = __package__.rsplit(".", 2)[0]
_ROOT = Path(__file__).resolve().parents[2]


def _default_folder() -> Path:
    base = os.environ.get("RESTIR_CACHE") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "restir_engine" / "kernels"


class _Location:
    folder: Path = _default_folder()


def configure(folder: str | os.PathLike) -> None:
    """Keep compiled kernels below `folder`. Call before the first kernel module is imported."""
    _Location.folder = Path(folder)


def root() -> Path:
    """The folder below which all compiled kernels are kept."""
    return _Location.folder


def module_folder(module: str) -> Path:
    """The cache folder for functions of `module` (its dotted name)."""
    relative = module.removeprefix(_PACKAGE + ".")
    path = _ROOT.joinpath(*relative.split(".")).with_suffix(".py")
    if not path.exists():  # a package, or a test's own kernels
        source = Path(sys.modules[module].__file__).read_bytes()
        return _used(root() / hashlib.sha1(module.encode() + source + _all_sources()).hexdigest()[:16])
    return _used(root() / _digest(path))


def _used(folder: Path) -> Path:
    """Note on the folder itself that it is in use, for `remove_old`."""
    if folder.is_dir():
        with contextlib.suppress(OSError):
            os.utime(folder)
    return folder


@cache
def _all_sources() -> bytes:
    digest = hashlib.sha1()
    for folder in ("kernels", "integrators"):
        for path in sorted((_ROOT / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.digest()


@cache
def _digest(path: Path) -> str:
    digest = hashlib.sha1(f"{_PACKAGE} {numba.__version__} {sys.version_info[:2]}".encode())
    for source in sorted(_dependencies(path)):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _dependencies(start: Path) -> set[Path]:
    """`start` and every module of this package that it imports, at any depth."""
    found: set[Path] = set()
    todo = [start]
    while todo:
        path = todo.pop()
        if path not in found:
            found.add(path)
            todo.extend(_imports(path))
    return found


@cache
def _imports(path: Path) -> tuple[Path, ...]:
    result = []
    for node in ast.walk(ast.parse(path.read_bytes())):
        if not isinstance(node, ast.ImportFrom) or node.level == 0:
            continue
        base = path.parents[node.level - 1]
        if node.module:
            base = base.joinpath(*node.module.split("."))
        names = [base.joinpath(alias.name) for alias in node.names]
        for candidate in [base, *names]:
            for file in (candidate.with_suffix(".py"), candidate / "__init__.py"):
                if file.exists() and file != path:
                    result.append(file)
    return tuple(result)


def remove_old(days: float = 30.0) -> None:
    """Delete cache folders whose module has not been imported for `days`: those of older versions of the sources."""
    if not root().is_dir():
        return
    limit = time.time() - days * 86400
    for folder in root().iterdir():
        if folder.is_dir() and folder.stat().st_mtime < limit:
            shutil.rmtree(folder, ignore_errors=True)
