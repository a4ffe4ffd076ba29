"""What a farm writes: the pictures of one machine, whatever fails, dies or is full meanwhile."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import bpy
import numpy as np
import pytest

from restir_engine.farm import redirect, renderer
from restir_engine.farm.child import Child, environment
from restir_engine.farm.tasks import FINISH, FRAME, SAMPLES, Job, Task
from testing.blender import farm
from testing.blender.render import read

# The file has no camera in frame 2, and a handler of it fails in frame 3.
HANDLER = """scene.camera = None if frame == 2 else bpy.data.objects["Camera"]
if frame == 3:
    raise ValueError("planted")"""


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A file of three frames that the compositor has a part in, and beside it what one machine makes of it."""
    folder = tmp_path_factory.mktemp("farm")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    path = farm.save(folder / "shot.blend", composited=True)
    farm.animation(path, folder / "one")
    return path


@pytest.fixture(scope="module")
def child():
    """A Blender that renders what it is asked for."""
    found = Child()
    yield found
    found.stop()


def prepared(child: Child, job: Job, resume: bool = False) -> Job:
    """The job with what a Blender finds out of it, begun."""
    facts = child.ask({"do": "facts", "job": job.fields()})
    assert facts["ok"], facts
    job = Job.of(job.fields() | {"digest": facts["digest"]})
    assert child.ask({"do": "begin", "job": job.fields(), "resume": resume})["ok"]
    return job


def rendered(child: Child, job: Job, *task) -> dict:
    """The outcome of a task."""
    return child.ask({"do": "task", "job": job.fields(), "task": Task(*task).fields()})


def pictures(folder: Path) -> dict[str, np.ndarray]:
    """All pictures that were written, by their paths."""
    files = [*folder.glob("out/*.exr"), *folder.glob("extra/*.exr")]
    return {str(path.relative_to(folder)): read(str(path)) for path in files}


def test_frames_are_those_of_one_machine(file, child):
    job = prepared(child, Job(str(file)))
    for frame in (3, 1, 2):
        outcome = rendered(child, job, FRAME, frame)
        assert outcome["ok"] and len(outcome["written"]) == 2, outcome
    expected, found = pictures(file.parent / "one"), pictures(file.parent)
    assert set(found) == set(expected) and len(found) == 6
    for name, picture in expected.items():
        np.testing.assert_array_equal(found[name], picture, err_msg=name)
    assert rendered(child, job, FRAME, 2)["there"]
    (file.parent / "out" / "frame_0002.exr").write_bytes(b"cut short")
    assert not rendered(child, job, FRAME, 2)["there"]
    assert not list(file.parent.glob("out/.restir-farm-*/unfinished-*"))


def test_ranges_are_made_into_the_frames_of_one_machine(file, child):
    job = prepared(child, Job(str(file), samples_per_task=3))
    for path in file.parent.glob("*/*_0001.exr"):
        path.unlink()
    assert rendered(child, job, SAMPLES, 1, 0, 3)["ok"]
    outcome = rendered(child, job, FINISH, 1)
    assert outcome["blame"] == "HOST" and "what follows 3" in outcome["text"]
    assert rendered(child, job, SAMPLES, 1, 3, 1)["ok"]
    assert rendered(child, job, SAMPLES, 1, 3, 1)["there"]
    assert not list(file.parent.glob("*/*_0001.exr"))
    outcome = rendered(child, job, FINISH, 1)
    assert outcome["ok"] and len(outcome["written"]) == 2, outcome
    expected, found = pictures(file.parent / "one"), pictures(file.parent)
    names = [name for name in expected if "0001" in name]
    assert len(names) == 2
    for name in names:
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-5, atol=1e-6, err_msg=name)
    assert not list(file.parent.glob("out/.restir-farm-*/frame_0001/*"))


def test_what_fails_is_named_and_the_rest_is_rendered(tmp_path, child):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    job = prepared(child, Job(str(farm.save(tmp_path / "shot.blend", handler=HANDLER)), scripts=True))
    outcomes = [rendered(child, job, FRAME, frame) for frame in (1, 2, 3)]
    assert [outcome["ok"] for outcome in outcomes] == [True, False, True]
    assert outcomes[1]["blame"] == "SCENE" and "no camera" in outcomes[1]["text"]
    assert outcomes[2]["handlers"] == ["bpy.app.handlers.frame_change_pre: ValueError: planted"]
    assert sorted(path.name for path in (tmp_path / "out").glob("*.exr")) == ["frame_0001.exr", "frame_0003.exr"]
    facts = child.ask({"do": "facts", "job": Job(job.scene).fields()})
    assert any("--enable-autoexec" in line for line in facts["warnings"])
    assert "not to be seen" in rendered(child, Job(str(tmp_path / "none.blend")), FRAME, 1)["text"]
    assert "another file" in rendered(child, Job(job.scene, digest="0"), FRAME, 1)["text"]
    unseen = Job.of(job.fields() | {"files": ("/none.png",), "output": str(tmp_path / "other")})
    assert "none.png" in rendered(child, unseen, FRAME, 1)["text"]


def test_all_views_of_a_frame_are_written_or_there(tmp_path, child):
    """And what is missing, or cannot be written to, is said."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.use_multiview, scene.render.use_overwrite = True, False
    bpy.data.images.new("Gone", 4, 4).filepath = "//gone.png"
    bpy.data.images["Gone"].source, bpy.data.images["Gone"].use_fake_user = "FILE", True
    path = farm.save(tmp_path / "shot.blend", size=8, samples=1)
    facts = child.ask({"do": "facts", "job": Job(str(path)).fields()})
    assert any("gone.png” is missing" in line and "Find Missing Files" in line for line in facts["warnings"])
    (tmp_path / "file").touch()
    nowhere = Job(str(path), output=str(tmp_path / "file" / "frame_")).fields()
    outcome = child.ask({"do": "begin", "job": nowhere, "resume": False})
    assert not outcome["ok"] and "cannot be written to" in outcome["text"] and "--output" in outcome["text"]
    views = {f"frame_0001_{side}.exr" for side in "LR"}
    for _ in range(2):
        outcome = rendered(child, Job(str(path), again=True), FRAME, 1)
        assert {Path(name).name for name in outcome["written"]} == views and not outcome["there"]
        assert rendered(child, Job(str(path), again=True), FRAME, 1)["there"]
        (tmp_path / "out" / "frame_0001_R.exr").unlink()


def test_a_cycles_file_has_the_samples_that_were_set_there(tmp_path, child):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    path = farm.save(tmp_path / "shot.blend")
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples, scene.restir.is_initialized = "CYCLES", 7, False
    scene.restir.property_unset("samples")
    bpy.ops.wm.save_mainfile()
    facts = child.ask({"do": "facts", "job": Job(str(path)).fields()})
    assert (facts["engine"], facts["samples"]) == ("RESTIR", 7)
    facts = child.ask({"do": "facts", "job": Job(str(path), engine="CYCLES", samples_per_task=4).fields()})
    assert facts["blame"] == "SCENE" and "ReSTIR's" in facts["text"]


def test_a_blender_that_dies_is_started_again(file, child):
    job = prepared(child, Job(str(file), output=str(file.parent / "again" / "frame_")))
    request = {"do": "task", "job": job.fields(), "task": Task(FRAME, 1).fields()}
    outcome = child.ask(request, lambda message: os.kill(child.greeting["pid"], signal.SIGKILL))
    assert not outcome["ok"] and outcome["blame"] == "HOST" and "SIGKILL" in outcome["text"]
    assert rendered(child, job, FRAME, 1)["ok"]


def test_a_full_disk_is_noticed_where_blender_does_not(scene, tmp_path, monkeypatch):
    """Blender 5.2 writes a PNG that is cut short, and is content."""
    scene.render.filepath = str(tmp_path / "{blend_name}" / "frame_")
    full = type("Usage", (), {"free": redirect.ROOM - 1})
    with redirect.redirected(scene, tmp_path / "state") as target:
        assert scene.render.filepath != str(tmp_path / "frame_")
        (target.places[0][0] / "frame_0001.png").write_bytes(b"picture")
        with monkeypatch.context() as patched, pytest.raises(redirect.DiskFull, match="is full on"):
            patched.setattr(shutil, "disk_usage", lambda path: full)
            target.deliver()
        written = target.deliver()
    assert written == [renderer.expanded(scene, str(tmp_path / "{blend_name}")) / "frame_0001.png"]
    assert written[0].read_bytes() == b"picture" and "{" not in str(written[0])
    assert scene.render.filepath == str(tmp_path / "{blend_name}" / "frame_")
    assert list((tmp_path / "state").iterdir()) == []


def test_simulations_that_are_not_baked_are_named(scene):
    bpy.ops.mesh.primitive_plane_add()
    bpy.context.object.name = "Flag"
    assert renderer.cautions(scene, Job("")) == []
    bpy.context.object.modifiers.new("Cloth", "CLOTH")
    [line] = renderer.cautions(scene, Job(""))
    assert "(Flag)" in line


def run_farm(file: Path, *arguments: str) -> subprocess.Popen:
    """The farm's command, with two workers of this machine."""
    command = [sys.executable, "-m", "restir_engine.farm", str(file), "--workers", "2", "--dashboard", ":0"]
    return subprocess.Popen(
        [*command, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment()
    )


@pytest.mark.deep
@pytest.mark.skipif(sys.platform == "win32", reason="processes are found by pgrep")
def test_a_worker_that_is_killed_changes_nothing(tmp_path):
    pytest.importorskip("distributed")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    file = farm.save(tmp_path / "shot.blend", size=64, samples=16, frames=5, handler=HANDLER)
    process = run_farm(file, "--frames", "1,3-5", "--samples-per-task", "4", "--enable-autoexec")
    while not list(tmp_path.glob("out/.restir-farm-*/frame_*/*.exr")) and process.poll() is None:
        time.sleep(0.1)
    found = subprocess.run(["pgrep", "-P", str(process.pid), "-f", "spawn_main"], capture_output=True, text=True)
    os.kill(int(found.stdout.split()[0]), signal.SIGKILL)
    output = process.communicate(timeout=100)[0]
    assert process.returncode == 0 and "4 of 4 frames written" in output, output
    assert "handler of the file failed" in output
    process = run_farm(file, "--frames", "1-3", "--samples-per-task", "4", "--enable-autoexec", "--resume")
    output = process.communicate(timeout=100)[0]
    assert process.returncode == 1 and "FAILED frame 2" in output and "Frame 1: was there" in output, output
    bpy.data.texts["handler.py"].clear()
    bpy.ops.wm.save_mainfile()
    farm.animation(file, tmp_path / "one")
    expected, found = pictures(tmp_path / "one"), pictures(tmp_path)
    assert sorted(found) == [f"out/frame_000{frame}.exr" for frame in (1, 3, 4, 5)]
    for name, picture in found.items():
        np.testing.assert_allclose(picture, expected[name], rtol=1e-5, atol=1e-6, err_msg=name)


@pytest.mark.deep
def test_an_open_job_description_runs(tmp_path):
    openjd = Path(sys.executable).with_name("openjd")
    if not openjd.exists():
        pytest.skip("openjd is not installed")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    file, job = farm.save(tmp_path / "shot.blend", frames=2), tmp_path / "job.yaml"
    process = run_farm(file, "--template", str(job), "--samples-per-task", "2")
    assert process.wait(timeout=100) == 0
    command = [openjd, "run", job, "-p", f"Python={sys.executable}"]
    result = subprocess.run([*command, "--output", "json"], capture_output=True, text=True, env=environment())
    assert result.returncode == 0, result.stdout
    assert json.loads(result.stdout[result.stdout.index("{") :])["status"] == "success"
    farm.animation(file, tmp_path / "one")
    expected, found = pictures(tmp_path / "one"), pictures(tmp_path)
    assert set(found) == set(expected) and len(found) == 2
    for name, picture in found.items():
        np.testing.assert_allclose(picture, expected[name], rtol=1e-5, atol=1e-6, err_msg=name)
