"""Compiled kernels: where they are kept, and that old ones go."""

import os
import time

import pytest

from restir_engine.kernels.core import cache


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(cache._Location, "folder", tmp_path)
    return tmp_path


def test_a_change_in_an_imported_module_changes_the_folder():
    vec, rng = (cache._ROOT / "kernels" / "core" / name for name in ("vec.py", "rng.py"))
    assert cache._ROOT / "kernels" / "core" / "memory.py" in cache._dependencies(vec)
    assert vec not in cache._dependencies(rng)
    assert cache._digest(vec) != cache._digest(rng)


def test_folders_in_use_stay_and_old_ones_go(folder):
    used = cache.module_folder("restir_engine.kernels.core.vec")
    stale = folder / "stale"
    for path in (used, stale):
        path.mkdir()
        os.utime(path, (time.time() - 90 * 86400,) * 2)
    assert cache.module_folder("restir_engine.kernels.core.vec") == used
    cache.remove_old(30.0)
    assert used.is_dir() and not stale.exists()
