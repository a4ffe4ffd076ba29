"""Compiled kernels on disk: what names them, who could have written them, damage, folders that cannot be used."""

import ast
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from restir_engine.kernels.core import cache, sources

KEY = "0123456789abcdef" * 2
ROOT = Path(__file__).resolve().parents[2]
OURS = os.getuid() if hasattr(os, "getuid") else None
as_root = pytest.mark.skipif(OURS != 0, reason="gives files to another user")


@pytest.fixture
def store(tmp_path):
    return cache.Store(tmp_path / "kernels", tmp_path / "private", None)


def test_a_change_in_an_imported_module_changes_the_digest():
    vec, rng, memory = (sources.ROOT / "kernels" / "core" / f"{name}.py" for name in ("vec", "rng", "memory"))
    assert memory in sources.dependencies(vec)
    assert vec not in sources.dependencies(rng)
    names = [f"{sources.PACKAGE}.kernels.core.{name}" for name in ("vec", "rng")]
    assert sources.digest(names[0]) != sources.digest(names[1])


def test_imports_are_found_as_python_finds_them():
    for path in (
        *sorted((sources.ROOT / "kernels").rglob("*.py")),
        *sorted((sources.ROOT / "integrators").rglob("*.py")),
    ):
        wanted = set()
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.level:
                base = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
                for candidate in [base, *(base / alias.name for alias in node.names)]:
                    wanted |= {f for f in (candidate.with_suffix(".py"), candidate / "__init__.py") if f.exists()}
        assert wanted - {path} <= set(sources.imports(path)), path


def test_what_is_written_is_read(store):
    assert store.read(KEY) is None
    store.write(KEY, b"code")
    assert store.read(KEY) == b"code"
    assert cache.Store(store.folder, store.private, None).read(KEY) == b"code"
    assert store.problem() == ""
    assert [f.name for f in store.folder.iterdir()] == [KEY]


def flipped(data: bytes, at: int) -> bytes:
    return data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]


@pytest.mark.parametrize(
    "damage",
    [lambda d: b"", lambda d: d[: len(d) // 2], lambda d: d[:20], lambda d: flipped(d, 3), lambda d: flipped(d, 50)],
    ids=["empty", "half", "within the digest", "bit of the digest", "bit of the code"],
)
def test_damaged_files_are_as_good_as_none_and_are_written_again(store, damage):
    store.write(KEY, bytes(range(100)))
    path = store.folder / KEY
    path.write_bytes(damage(path.read_bytes()))
    assert store.read(KEY) is None
    store.write(KEY, b"code")
    assert store.read(KEY) == b"code"


def test_a_file_under_the_name_of_another_is_not_read(store):
    store.write(KEY, b"code")
    os.replace(store.folder / KEY, store.folder / KEY[::-1])
    assert store.read(KEY[::-1]) is None


@pytest.mark.skipif(OURS is None, reason="Windows closes the folders of users")
@pytest.mark.parametrize("mode", [0o777, 0o775, 0o757])
def test_folders_that_others_can_write_to_are_neither_read_nor_written(store, mode):
    store.write(KEY, b"code")
    store.folder.chmod(mode)
    fresh = cache.Store(store.folder, store.private, None)
    assert fresh.read(KEY) is None
    fresh.write(KEY, b"other")
    assert (store.folder / KEY).read_bytes().endswith(b"code")
    assert fresh.read(KEY) == b"other"
    assert str(fresh.folder) in fresh.problem() and "RESTIR_CACHE" in fresh.problem()


@as_root
@pytest.mark.parametrize("what", ["folder", "file"])
def test_what_another_user_owns_is_not_read(store, what):
    store.write(KEY, b"code")
    os.chown(store.folder if what == "folder" else store.folder / KEY, 12345, 12345)
    assert cache.Store(store.folder, store.private, None).read(KEY) is None


@as_root
def test_what_the_system_owns_is_read(store, monkeypatch):
    store.write(KEY, b"code")
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    assert cache.Store(store.folder, store.private, None).read(KEY) == b"code"


@pytest.mark.skipif(OURS is None, reason="no links")
def test_the_private_folder_is_private(store, tmp_path):
    """Whoever is first to make it under the name that we use gains nothing."""
    store.folder = None
    store.write(KEY, b"code")
    assert store.private.stat().st_mode & 0o777 == 0o700
    assert store.read(KEY) == b"code" and "RESTIR_CACHE" in store.problem()
    linked = tmp_path / "linked"
    linked.symlink_to(store.private, target_is_directory=True)
    other = cache.Store(None, linked, None)
    other.write(KEY[::-1], b"code")
    assert other.read(KEY) is None and not (store.private / KEY[::-1]).exists()


@pytest.mark.parametrize("folder", [None, Path("/proc/x/kernels"), Path(__file__) / "kernels"])
def test_without_any_folder_one_sentence_says_so(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    store = cache.Store(folder, Path("/proc/y"), None)
    assert store.problem() == ""  # nothing was compiled yet
    store.write(KEY, b"code")
    assert store.read(KEY) is None
    assert "compiled each time" in store.problem() and "RESTIR_CACHE" in store.problem()
    assert not list(tmp_path.iterdir())


def test_kernels_on_a_read_only_file_system_are_loaded(store, monkeypatch):
    store.write(KEY, b"code")
    monkeypatch.setattr(os, "access", lambda path, mode: path != store.folder)  # as the system says there
    fresh = cache.Store(store.folder, store.private, None)
    assert fresh.read(KEY) == b"code" and fresh.problem() == ""
    fresh.write(KEY[::-1], b"more")
    assert fresh.read(KEY[::-1]) == b"more" and "ead-only" in fresh.problem()
    assert not (store.folder / KEY[::-1]).exists()


def test_a_full_disk_leaves_no_half_files(store, monkeypatch):
    def full(file, mode):
        if mode == "rb":
            return open(file, mode)
        os.close(file)
        raise OSError(28, "No space left on device")

    store.write(KEY, b"code")
    monkeypatch.setattr(cache, "open", full, raising=False)
    store.write(KEY[::-1], b"more")
    monkeypatch.undo()
    assert [f.name for f in store.folder.iterdir()] == [KEY]
    assert "No space left" in store.problem()


@pytest.mark.parametrize("unknown", [{}, {"HOME": "/proc/x"}])
def test_without_a_home_there_is_a_default_or_none(unknown, monkeypatch):
    for name in ("HOME", "USERPROFILE", "RESTIR_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in unknown.items():
        monkeypatch.setenv(name, value)
    if not unknown:
        monkeypatch.setattr(Path, "home", lambda: (_ for _ in ()).throw(RuntimeError("no home")))
    folder = cache.default_folder()
    assert folder is None if not unknown else folder.is_absolute()


def test_files_in_use_stay_and_old_ones_go(store):
    for key in (KEY, KEY[::-1]):
        store.write(key, b"code")
        os.utime(store.folder / key, (time.time() - 90 * 86400,) * 2)
    (store.folder / "README").touch()
    assert store.read(KEY) == b"code"  # which notes that it is in use
    store.remove_old(30.0)
    assert sorted(f.name for f in store.folder.iterdir()) == sorted([KEY, "README"])
    store.remove()
    assert [f.name for f in store.folder.iterdir()] == ["README"]


# Windows ends paths at 259 characters where long ones were not switched on.
WINDOWS_LIMIT = 259
USER = "u" * 40
EXTENSIONS = rf"C:\Users\{USER}\AppData\Roaming\Blender Foundation\Blender\5.2\extensions"


def test_paths_stay_within_the_limit_of_windows():
    longest = cache.NAME_LENGTH + cache.SUFFIX_LENGTH + 1
    for folder in (
        rf"{EXTENSIONS}\.user\user_default\restir_engine\kernels",
        rf"C:\Users\{USER}\.cache\restir_engine\kernels",
        rf"C:\Users\{USER}\AppData\Local\Temp\restir-kernels-0",
        rf"{EXTENSIONS}\user_default\restir_engine\restir_engine\compiled",
    ):
        assert len(folder) + longest <= WINDOWS_LIMIT, folder
    installed = [path.relative_to(ROOT) for path in sources.ROOT.rglob("*.py")]
    assert max(len(rf"{EXTENSIONS}\user_default\restir_engine\{path}") for path in installed) <= WINDOWS_LIMIT - 60


LOADED = """
import importlib, sys
digest = importlib.import_module(sys.argv[1] + ".kernels.core.digest")
jit = importlib.import_module(sys.argv[1] + ".kernels.core.jit")
import numpy as np
jit.load([digest.murmur3])
print(*digest.digest(np.arange(100)), digest.murmur3.stats.cache_hits.total(), int("numba.np.npyimpl" in sys.modules))
"""


def caching_in(folder: Path, path: Path) -> dict[str, str]:
    """The environment of a process that keeps kernels in `folder`, and finds none that another run left elsewhere."""
    (folder / "temporary").mkdir(exist_ok=True)
    own = {"PYTHONPATH": str(path), "RESTIR_CACHE": str(folder), "TMPDIR": str(folder / "temporary")}
    return os.environ | own | {"RESTIR_WORKER": "1"}


def run_as(package: str, path: Path, folder: Path) -> list[str]:
    """Two numbers that a kernel makes, 1 if it was loaded, 1 if Numba has read what it compiles with.

    In a process that knows the package by some name.
    """
    environment = caching_in(folder, path)
    command = [sys.executable, "-c", LOADED, package]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.split()


def test_kernels_fit_under_another_import_name_and_strange_folders(tmp_path):
    """As below bl_ext.NAME_OF_A_REPOSITORY, from a folder with spaces and umlauts."""
    folder = tmp_path / "größte Mühe "
    (folder / "repository").mkdir(parents=True)
    (folder / "repository" / "other").symlink_to(sources.ROOT, target_is_directory=True)
    first = run_as("restir_engine", ROOT, folder)
    second = run_as("repository.other", folder, folder)
    assert first[:2] == second[:2]
    assert (first[2:], second[2:]) == (["0", "1"], ["1", "0"])


ALL_LOADED = """
import sys
from restir_engine.kernels.core import jit
kept = [unit for unit in map(jit.named, jit.all_units()) if jit.is_kept(unit)]
for unit in kept:
    jit.compile_here(unit)
print(len(kept), "numba.np.npyimpl" in sys.modules)
"""


def test_all_that_is_kept_loads_in_a_process_that_compiles_nothing():
    """LLVM would end the process at a symbol that is missing."""
    environment = os.environ | {"PYTHONPATH": str(ROOT), "RESTIR_WORKER": "1"}
    said = subprocess.run([sys.executable, "-c", ALL_LOADED], env=environment, capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    assert said.stdout.split()[1] == "False"


def test_a_damaged_kernel_is_compiled_again(tmp_path):
    first = run_as("restir_engine", ROOT, tmp_path)
    for path in (tmp_path / "restir_engine" / "kernels").iterdir():
        path.write_bytes(flipped(path.read_bytes(), path.stat().st_size // 2))
    assert [run_as("restir_engine", ROOT, tmp_path)[2] for _ in range(2)] == ["0", "1"]
    assert run_as("restir_engine", ROOT, tmp_path)[:2] == first[:2]


@pytest.mark.deep
def test_four_first_starts_at_once_of_which_one_is_killed(tmp_path):
    environment = caching_in(tmp_path, ROOT)
    command = [sys.executable, "-c", LOADED, "restir_engine"]
    starts = [subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) for _ in range(4)]
    time.sleep(2.0)
    starts[0].kill()
    results = [start.communicate()[0].split()[:2] for start in starts][1:]
    assert all(len(numbers) == 2 and numbers == results[0] for numbers in results)
    assert run_as("restir_engine", ROOT, tmp_path)[:3] == [*results[0], "1"]
