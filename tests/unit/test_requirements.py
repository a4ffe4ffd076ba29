"""Packages that another extension replaced: which, by whom, and what to do."""

from importlib import metadata

import pytest

from restir_engine import requirements


@pytest.fixture
def versions(monkeypatch):
    """The versions that are found, to be changed."""
    found = dict(requirements.WHEELS)
    monkeypatch.setattr(metadata, "version", found.__getitem__)
    return found


def test_the_versions_that_are_shipped_are_no_problem(versions):
    assert requirements.problem() == ""


@pytest.mark.parametrize("package, version", [("numba", "0.68.2"), ("llvmlite", "0.50.1"), ("embreex", "4.5.0")])
def test_newer_versions_of_the_same_series_are_no_problem(versions, package, version):
    versions[package] = version
    assert requirements.problem() == ""


@pytest.mark.parametrize(
    "package, version, way_out",
    [
        ("numba", "0.61.0", "update or disable"),
        ("numba", "0.69.0", "update ReSTIR"),
        ("llvmlite", "0.44.0", "update or disable"),
        ("llvmlite", "0.51.0rc1", "update ReSTIR"),
        ("embreex", "2.17.7", "update or disable"),
        ("embreex", "5.0.0", "update ReSTIR"),
    ],
)
def test_others_are_a_sentence_that_says_which_and_what_to_do(versions, package, version, way_out):
    versions[package] = version
    text = requirements.problem()
    assert all(part in text for part in (package, version, requirements.WHEELS[package], way_out, "ReSTIR zip"))


def test_the_sentence_names_the_extension_that_brings_a_package(versions, monkeypatch, tmp_path):
    ours, other, broken = (tmp_path / "extensions" / f for f in ("user_default/restir", "org/other", "org/broken"))
    for folder in (ours, other, broken):
        folder.mkdir(parents=True)
        (folder / "blender_manifest.toml").write_text(
            'name = "Fast Nodes"\nwheels = ["./wheels/numba-0.61.0-cp311-cp311-win_amd64.whl"]'
        )
    (broken / "blender_manifest.toml").write_text("name = ")
    monkeypatch.setattr(requirements, "_ROOT", ours)
    versions["numba"] = "0.61.0"
    assert "the extension “Fast Nodes”:" in requirements.problem()
    (other / "blender_manifest.toml").unlink()
    assert "It comes from “" in requirements.problem()
