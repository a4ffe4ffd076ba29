"""The extension's zip: what is in it, and the manifest it gets."""

import tomllib
import zipfile
from pathlib import Path

from restir_engine.kernels.core import cache
from tools import build


def test_manifest_of_a_zip_lists_platform_and_wheels():
    text = build.manifest("linux-x64", [Path("a-1.whl"), Path("b-2.whl")])
    manifest = tomllib.loads(text)
    assert manifest["wheels"] == ["./wheels/a-1.whl", "./wheels/b-2.whl"]
    assert manifest["platforms"] == ["linux-x64"]
    assert manifest["id"] == "restir_engine" and manifest["license"] == ["SPDX:GPL-3.0-or-later"]
    assert len(manifest["tagline"]) <= 64 and not manifest["tagline"].endswith(".")
    assert "permissions" not in manifest


def test_all_files_of_the_engine_are_shipped_and_no_others():
    shipped = {path.relative_to(build.ROOT).as_posix() for path in build.sources()}
    assert {"__init__.py", "LICENSE", "ui/__init__.py", "restir_engine/engine.py"} <= shipped
    assert all(name.split("/")[0] in {*build.FOLDERS, *build.FILES} for name in shipped)
    there = {
        path.relative_to(build.ROOT).as_posix()
        for folder in build.FOLDERS
        for path in (build.ROOT / folder).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert there <= shipped


def test_zip_holds_manifest_sources_and_wheels(tmp_path, monkeypatch):
    wheel = tmp_path / "numba-1-cp311.whl"
    wheel.write_bytes(b"wheel")
    kernel = tmp_path / ("5" * cache.NAME_LENGTH)
    kernel.write_bytes(b"kernel")
    monkeypatch.setattr(build, "download", lambda python, platform, folder: [wheel])
    monkeypatch.setattr(build, "compile_kernels", lambda python, *where: [kernel] if python == "3.13" else [])
    path = build.build(["3.11", "3.13"], "linux-x64", "test", tmp_path / "out")
    assert [item.name for item in (tmp_path / "out").iterdir()] == [path.name]
    names = zipfile.ZipFile(path).namelist()
    assert len(names) == len(set(names))
    assert {"blender_manifest.toml", "wheels/numba-1-cp311.whl", "restir_engine/engine.py"} <= set(names)
    assert (cache.SHIPPED / kernel.name).relative_to(build.ROOT).as_posix() in names


def test_kernels_are_compiled_ahead_for_this_platform_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(build.subprocess, "run", None)
    other = next(platform for platform in build.WHEEL_TAGS if platform != build.this_platform())
    assert build.compile_kernels("3.13", other, tmp_path) == []
    assert build.this_platform() in {"", *build.WHEEL_TAGS}
    assert build.baseline() is not None or not build.this_platform()
