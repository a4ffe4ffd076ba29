"""The extension's zip: what is in it, and the manifest it gets."""

import tomllib
import zipfile
from pathlib import Path

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
    monkeypatch.setattr(build, "download", lambda python, platform, folder: [wheel])
    path = build.build(["3.11", "3.13"], "linux-x64", "test", tmp_path / "out")
    assert [item.name for item in (tmp_path / "out").iterdir()] == [path.name]
    names = zipfile.ZipFile(path).namelist()
    assert len(names) == len(set(names))
    assert {"blender_manifest.toml", "wheels/numba-1-cp311.whl", "restir_engine/engine.py"} <= set(names)
