"""A farm's tasks: frames and ranges of samples, their order, what is tried again; the template that describes them."""

import contextlib
import io
import json
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from restir_engine.farm import __main__ as farm
from restir_engine.farm import child, progress, template
from restir_engine.farm.tasks import (
    FINISH,
    FRAME,
    SAMPLES,
    Job,
    Plan,
    Task,
    parse_frames,
    sample_ranges,
    spans,
)
from restir_engine.farm.turns import turn
from restir_engine.kernels.core import locks


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        ("7", [7]),
        ("1-3,20", [1, 2, 3, 20]),
        ("1..3, 2-5", [1, 2, 3, 4, 5]),
        ("10-20:5", [10, 15, 20]),
        ("-2-1,-5", [-2, -1, 0, 1, -5]),
    ],
)
def test_frames_are_read(text, frames):
    assert parse_frames(text) == frames
    assert parse_frames(spans(frames)) == sorted(frames)


@pytest.mark.parametrize("text", ["", "a", "1-", "5-1", "1-5:0", "1,,2"])
def test_what_is_no_frame_is_named(text):
    with pytest.raises(ValueError, match=r"frame|lead nowhere"):
        parse_frames(text)


def test_ranges_hold_each_sample_once():
    for samples, per_task in ((256, 64), (100, 64), (5, 8), (7, 0), (1, 1)):
        ranges = sample_ranges(samples, per_task)
        assert [s for first, count in ranges for s in range(first, first + count)] == list(range(samples))
        assert all(count <= per_task or not per_task for _, count in ranges)


def test_a_frame_is_finished_as_soon_as_its_ranges_are_there():
    plan = Plan([1, 2], sample_ranges(8, 4))
    tasks = [plan.next() for _ in range(3)]
    assert tasks == [Task(SAMPLES, 1, 0, 4), Task(SAMPLES, 1, 4, 4), Task(SAMPLES, 2, 0, 4)]
    for task in reversed(tasks[:2]):
        plan.done(task)
    finish = plan.next()
    assert finish == Task(FINISH, 1) and plan.next() == Task(SAMPLES, 2, 4, 4) and plan.next() is None
    assert plan.written == [] and plan.done_samples == 8
    plan.done(finish)
    assert plan.written == [1] and not plan.ended


def test_a_machines_fault_is_tried_elsewhere_and_a_scenes_is_not():
    plan = Plan([1, 2, 3], [(0, 4)], tries=3)
    one, two, three = (plan.next() for _ in range(3))
    assert one.kind == FRAME
    assert not plan.failed(two, "no camera", elsewhere=False)
    for worker, again in (("a", True), ("b", True), ("c", False)):
        assert plan.failed(one, "disk full", elsewhere=True, worker=worker) == again
        assert plan.next() == (one if again else None)
    assert plan.avoid[one] == {"a", "b"}
    plan.done(three)
    assert plan.ended and plan.written == [3] and plan.failures == {2: "no camera", 1: "disk full"}
    assert plan.done_samples == plan.total_samples == 12


def test_what_is_left_of_a_failed_frame_is_not_rendered():
    plan = Plan([1, 2], sample_ranges(8, 4))
    plan.failed(plan.next(), "no camera", elsewhere=False)
    assert plan.next() == Task(SAMPLES, 2, 0, 4)
    assert not plan.failed(Task(SAMPLES, 1, 4, 4), "disk full", elsewhere=True)


def test_progress_counts_what_is_being_rendered():
    plan = Plan([1, 2], sample_ranges(8, 4))
    shown = progress.Progress(plan, stream=io.StringIO())
    first = plan.next()
    plan.done(first)
    line = shown.line({Task(SAMPLES, 1, 4, 4): 2}, 2, shown._began + 6.0)
    assert line == "Frames 0/2 | Samples 6/16 | Remaining 0:00:10 | Workers 2"
    assert shown.line({}, 0, 0.0).endswith("Waiting for workers")


def test_the_terminal_is_told_once_what_is_worth_a_warning():
    stream = io.StringIO()
    shown = progress.Progress(Plan([1, 2], [(0, 4)]), "Blender 5.2.3", stream)
    outcome = {"ok": True, "there": False, "written": ["a.png"], "host": "h", "seconds": 1.0, "handlers": []}
    for frame in (1, 2):
        shown.outcome(Task(FRAME, frame), outcome | {"warnings": ["no lamp"], "version": "Blender 4.5.15"})
    failed = {"ok": False, "again": False, "text": "no camera", "log": ["Fra: 3"], "host": "h", "handlers": []}
    shown.outcome(Task(FRAME, 3), failed)
    assert stream.getvalue().splitlines() == [
        "Frame 1: a.png (h, 1.0 s)",
        "WARNING no lamp",
        "WARNING h renders with Blender 4.5.15, others with Blender 5.2.3",
        "Frame 2: a.png (h, 1.0 s)",
        "FAILED frame 3, on h: no camera",
        "    Fra: 3",
    ]


def test_what_is_shown_last_says_what_to_do():
    stream, plan = io.StringIO(), Plan([1, 2, 3], [(0, 4)])
    shown = progress.Progress(plan, stream=stream)
    plan.done(plan.next())
    for frame in (2, 3):
        plan.failed(plan.next(), f"frame {frame}, on h: no camera\n    Fra: {frame}", elsewhere=False)
    shown.warn("no lamp")
    shown._written -= 2.0 * progress.EVERY  # so long nothing was shown
    for workers in (1, 0, 0):
        shown.show({}, workers)
        shown._written -= 0.6 * progress.EVERY
    assert farm.summary(plan, shown) == 1
    lines = [line for line in stream.getvalue().splitlines() if not line.startswith("Frames")]
    assert "Waiting for workers" in stream.getvalue()
    assert lines[1:] == [
        "1 of 3 frames written, 1 warning.",
        "FAILED frame 2, on h: no camera",
        "FAILED frame 3, on h: no camera",
        "When that is mended, --frames 2-3 renders these again.",
    ]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere.blend"], "is no file"),
        (["nowhere.blend", "--samples", "-3"], "at least 0"),
        (["nowhere.blend", "--workers", "0"], "at least 1"),
        (["nowhere.blend", "--frames", "5-1"], "lead nowhere"),
        (["nowhere.blend", "--scheduler", "foo://bar:1"], "No Dask scheduler answers"),
    ],
)
def test_what_cannot_be_meant_is_said_before_anything_begins(arguments, said, capfd):
    try:
        code = farm.main(arguments)
    except SystemExit as end:
        code = end.code
    assert code in (1, 2) and said in capfd.readouterr().err


def test_a_blender_that_is_none_is_said(tmp_path):
    for blender, said in ((tmp_path / "nowhere", "there is no"), (Path(sys.executable), "before it could render")):
        outcome = child.Child(str(blender)).ask({"do": "facts"})
        assert not outcome["ok"] and said in outcome["text"] and "--blender" in outcome["text"]


def test_jobs_are_told_apart_by_what_they_render():
    job = Job("/a/scene.blend", digest="1", output="/x/frame_", samples_per_task=8)
    assert Job.of(json.loads(json.dumps(job.fields()))) == job
    same = Job("/b/scene.blend", digest="1", output="/y/frame_", samples_per_task=8, threads=3)
    assert same.name == job.name
    others = {"digest": "2", "output": "/x/other_", "samples_per_task": 4, "samples": 9, "engine": "CYCLES"}
    names = {Job.of(job.fields() | {key: value}).name for key, value in others.items()}
    assert len(names) == len(others) and job.name not in names


def test_errors_of_handlers_are_found_among_what_blender_prints():
    lines = """Fra:4
Error in bpy.app.handlers.frame_change_pre[0]:
Traceback (most recent call last):
  File "handler.py", line 6, in entered
    raise ValueError('planted')
ValueError: planted
Error in bpy.app.handlers.render_post[1]:
Traceback (most recent call last):
  File "handler.py", line 8, in other
KeyError: 3
Saved: frame"""
    assert child.handler_errors(lines.splitlines()) == [
        "bpy.app.handlers.frame_change_pre: ValueError: planted",
        "bpy.app.handlers.render_post: KeyError: 3",
    ]
    assert child.handler_errors(["Saved: frame"]) == []


def test_a_lock_is_held_by_one_process_and_gone_with_it(tmp_path):
    path = tmp_path / "lock"
    code = (
        "import sys, pathlib; from restir_engine.kernels.core import locks\n"
        "file = locks.take(pathlib.Path(sys.argv[1])); print(file is not None, flush=True); sys.stdin.read()"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "True\n"
    assert locks.take(path) is None
    with locks.held(path, patience=0.0):  # nobody waits for ever
        pass
    process.kill()
    process.wait()
    with locks.held(path):
        pass
    assert locks.take(tmp_path / "nowhere" / "lock") is None


def test_renders_take_turns_with_the_cores_of_a_machine(tmp_path, monkeypatch):
    """As many at once as have all cores together; who ends in whatever way lets the next one go on."""
    monkeypatch.setattr(locks, "folder", lambda: tmp_path)
    for threads, cores, at_once, renders in ((0, 4, 1, 3), (2, 4, 2, 4), (8, 4, 1, 2), (1, 3, 3, 3)):
        together, going, most = threading.Barrier(at_once, timeout=60.0), [], []

        def render(_, threads=threads, cores=cores, together=together, going=going, most=most) -> None:
            with turn(threads, cores):
                going.append(threads)
                together.wait()  # or raise
                most.append(len(going))
                going.pop()

        with ThreadPoolExecutor(renders) as pool:
            list(pool.map(render, range(renders)))
        assert len(most) == renders and max(most) <= at_once
    with contextlib.suppress(ZeroDivisionError), turn(0, 1):
        raise ZeroDivisionError
    with turn(0, 1):
        pass
    monkeypatch.setattr(locks, "folder", lambda: tmp_path / "nowhere")
    with turn(0, 1), turn(0, 1):  # nobody waits for what cannot be held
        pass


@pytest.mark.parametrize(("per_task", "blender"), [(0, ""), (64, "/opt/blender")])
def test_template_says_what_open_job_description_understands(tmp_path, per_task, blender):
    path = tmp_path / "job.yaml"
    job = Job(str(tmp_path / "shot 7.blend"), output=str(tmp_path / "out" / "frame_"), samples_per_task=per_task)
    template.write(path, template.template(job, [1, 2, 3, 9], 200, blender, path))
    openjd = Path(sys.executable).with_name("openjd")
    if not openjd.exists():
        pytest.skip("openjd is not installed")
    checked = subprocess.run([openjd, "check", path], capture_output=True, text=True)
    assert checked.returncode == 0, checked.stdout + checked.stderr
    summary = subprocess.run([openjd, "summary", path], capture_output=True, text=True).stdout
    tasks = {"Render": 16, "Finish": 4} if per_task else {"Render": 4}
    assert f"Total tasks: {sum(tasks.values())}" in summary, summary
