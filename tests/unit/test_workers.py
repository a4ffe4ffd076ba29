"""Processes that compile: what they are asked for by name, what they leave in the cache, and where they fail."""

import subprocess
import sys
import tempfile

import pytest

from restir_engine.kernels.core import cache, digest, jit, locks, worker, workers
from restir_engine.kernels.shading import math_ops

NAME = "kernels.core.digest:murmur3"


@pytest.fixture
def empty(tmp_path, monkeypatch):
    """An empty cache for this process and its workers, whatever another run left among the temporary files."""
    monkeypatch.setenv("RESTIR_CACHE", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    store = cache.Store(cache.default_folder(), None, None)
    monkeypatch.setattr(cache._Current, "store", store)
    return store


def test_kernels_and_entries_are_found_by_name():
    for unit, name in ((digest.murmur3, NAME), (math_ops.math_op, "kernels.shading.math_ops:math_op")):
        assert jit.name_of(unit) == name and jit.named(name) is unit
    names = jit.all_units()
    assert NAME in names and "integrators.path.tile:render_tile" in names
    assert all(jit.is_unit(jit.named(name)) for name in names)
    assert "kernels.core.memory:copy_words" not in names  # kernels contain it


def test_what_another_process_compiles_is_waited_for(empty):
    """And is not compiled again: the file stays as that process has left it."""
    key = worker._key(digest.murmur3)
    pool = workers.Workers(1)
    with locks.held(locks.folder() / f"kernel-{key[:2]}"):
        [future] = pool.submit([NAME], urgent=True)
        with pytest.raises(TimeoutError):
            future.result(timeout=3.0)
        empty.write(key, b"compiled elsewhere")
    assert future.result(timeout=20.0)
    assert empty.read(key) == b"compiled elsewhere"


def test_a_worker_leaves_in_the_cache_what_it_is_asked_for(empty):
    pool = workers.Workers(1)
    assert pool.progress == (0, 0) and not jit.is_kept(digest.murmur3)
    missing = "kernels.core.digest:not_there"
    futures = pool.submit([NAME, missing], urgent=True)
    assert pool.submit([NAME], urgent=True)[0] is futures[0]
    pool.wait(futures)
    assert [future.result() for future in futures] == [True, False]
    assert jit.is_kept(digest.murmur3)


def test_workers_import_nothing_from_the_current_folder(empty, monkeypatch, tmp_path):
    for name in ("numba", "restir_engine"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('this is somebody else')")
    monkeypatch.chdir(tmp_path)
    pool = workers.Workers(1)
    assert pool.submit([NAME], urgent=True)[0].result(timeout=60.0)


def test_a_worker_that_dies_is_told_from_one_that_is_done(empty, monkeypatch):
    dies = [sys.executable, "-c", "import sys; sys.stdin.readline()"]
    monkeypatch.setattr(workers, "command", lambda *arguments: dies)
    pool = workers.Workers(1)
    assert [f.result() for f in pool.submit([NAME, "kernels.core.vec:dot"], urgent=True)] == [False, False]
    monkeypatch.setattr(workers, "command", lambda *arguments: ["/nowhere/python"])
    assert not workers.Workers(1).submit([NAME], urgent=True)[0].result()


@pytest.mark.parametrize("python", ["/usr/bin/blender", "", None])
def test_without_a_python_to_start_nothing_is_started(python, empty, monkeypatch):
    monkeypatch.setattr(sys, "executable", python)
    monkeypatch.setattr(subprocess, "Popen", None)
    assert not workers.can_start()
    workers.compile_all([NAME])
    assert workers.begin([NAME]) == []


def test_kernels_of_tests_are_compiled_where_they_are_needed(empty, monkeypatch):
    monkeypatch.setattr(subprocess, "Popen", None)
    workers.compile_all(["testing.kernels.lobes:somewhere_else"])
