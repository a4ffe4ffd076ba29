"""Renders tasks in this Blender: one file stays open from task to task, and with it what the engine keeps.

A result appears under its name when it is whole. What is there already is not rendered again: of each frame a record
is left, and a range is a file.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import socket
import time
import tomllib
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path

import bpy

from .. import engine, session, warning_log
from ..sync.camera import NO_CAMERA
from .redirect import check_room, expanded, frame_paths, redirected, unfinished
from .tasks import FINISH, FRAME, SAMPLES, Job, Task, digest_of
from .turns import turn

FOLDER = ".restir-farm"  # beside the pictures: unfinished files and records
_SAMPLE = re.compile(r"Sample (\d+)/\d+")
# How a range is written: what is measured, exactly. What it is made into a picture by comes when ranges are merged.
_RANGE = (
    ("use_compositing", False),
    ("use_sequencer", False),
    ("use_stamp", False),
    ("use_file_extension", True),
    ("use_overwrite", True),
    ("image_settings.media_type", "MULTI_LAYER_IMAGE"),
    ("image_settings.file_format", "OPEN_EXR_MULTILAYER"),
    ("image_settings.color_mode", "RGBA"),
    ("image_settings.color_depth", "32"),
    ("image_settings.exr_codec", "ZIP"),
    ("image_settings.use_preview", False),
    ("image_settings.views_format", "MULTIVIEW"),
    ("image_settings.color_management", "FOLLOW_SCENE"),
)


class NotHere(OSError):
    """This machine cannot render a task that another may."""


class NotRendered(Exception):
    """What Blender said when it could not render a task."""


class Renderer:
    """Renders tasks of one job after the other."""

    def __init__(self) -> None:
        self._open: tuple = ()
        self._cores = 0
        engine.render_for_farm(self._turn)

    def _turn(self, threads: int) -> AbstractContextManager:
        return turn(threads, self._cores)

    def facts(self, job: Job) -> dict:
        """What a job consists of, by its file: see the keys. Its `files` are those that this machine sees."""
        self.open(job)
        scene = bpy.context.scene
        if scene.render.is_movie_format:
            raise NotRendered(
                "The output is a movie, one file that a single machine has to write: choose an image format in Output "
                "Properties, save the file, and make the movie of the frames that the farm writes; or render it by "
                "blender -b FILE -a."
            )
        if job.samples_per_task and scene.render.engine != "RESTIR":
            raise NotRendered(f"Ranges of samples are ReSTIR's, but the scene is rendered by {scene.render.engine}.")
        job = replace(job, digest=digest_of(Path(job.scene)))
        missing = [path for path in outside_files() if not os.path.exists(path)]
        return {
            "digest": job.digest,
            "state": str(self._state(job)),
            "files": [path for path in outside_files() if os.path.exists(path)],
            "frames": list(range(scene.frame_start, scene.frame_end + 1, scene.frame_step)),
            "samples": scene.restir.samples,
            "engine": scene.render.engine,
            "path": scene.render.frame_path(frame=scene.frame_start),
            "output": bpy.path.abspath(scene.render.filepath),
            "warnings": [*cautions(scene, job), *map(_without, missing)],
        }

    def begin(self, job: Job, resume: bool) -> None:
        """Before the first task of a run; resume: what earlier runs of the same job have left is taken."""
        self.open(job)
        if not resume:
            shutil.rmtree(self._state(job), ignore_errors=True)
        with unfinished(self._state(job)):
            pass  # or say where nothing can be written

    def run(self, job: Job, task: Task, told: Callable[[int], None] = lambda samples: None) -> dict:
        """Render a task; told: called with the samples that are done meanwhile."""
        self.open(job)
        began = time.monotonic()
        warning_log.clear()
        with samples_told(told):
            written = _KINDS[task.kind](self, job, task)
        scene = bpy.context.scene
        return {
            "written": [str(path) for path in written or ()],
            "there": written is None,
            "warnings": list(warning_log.lines(scene.name)),
            "seconds": time.monotonic() - began,
            "memory": session.memory_in_use(),
        }

    def open(self, job: Job) -> None:
        """Open a job's file where it is not open."""
        wanted = (job.scene, job.digest, job.output, job.samples, job.engine, job.scripts)
        if wanted != self._open:
            self._open = ()
            path = Path(job.scene)
            if not path.exists():
                raise NotHere(f"“{path}” is not to be seen on {socket.gethostname()}: {SHARED}")
            if job.digest and digest_of(path) != job.digest:
                raise NotHere(f"“{path}” is another file on {socket.gethostname()}, or has been saved meanwhile")
            try:
                bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=job.scripts, display_file_selector=False)
            except RuntimeError:
                raise NotRendered(f"“{path}” is no file that Blender {bpy.app.version_string} can open.") from None
            self._set_up(bpy.context.scene, job)
            unseen = [name for name in job.files if not os.path.exists(name)]
            if unseen:
                raise NotHere(f"“{unseen[0]}” is not to be seen on {socket.gethostname()}: {SHARED}")
            self._open = wanted
        self._cores = job.cores
        if job.threads or job.cores:
            bpy.context.scene.render.threads_mode = "FIXED"
            bpy.context.scene.render.threads = job.threads or job.cores

    def close(self) -> None:
        """Let the next task open its file anew."""
        self._open = ()

    @staticmethod
    def _set_up(scene: bpy.types.Scene, job: Job) -> None:
        if job.engine:
            try:
                scene.render.engine = job.engine
            except TypeError as error:
                known = str(error).partition("not found in ")[2]
                raise NotRendered(f"There is no render engine “{job.engine}”: --engine is one of {known}.") from None
        if job.output:
            scene.render.filepath = job.output
        # What the engine's operators would do as the render begins: the samples are asked for before.
        new = scene.render.engine == "RESTIR" and not scene.restir.is_initialized
        if new and hasattr(bpy.types, "RESTIR_OT_settings_from_cycles") and bpy.ops.restir.settings_from_cycles.poll():
            bpy.ops.restir.settings_from_cycles(keep_changed=True)
        if job.samples:
            scene.restir.samples = job.samples

    @staticmethod
    def _state(job: Job) -> Path:
        scene = bpy.context.scene
        return expanded(scene, os.path.dirname(scene.render.filepath)) / f"{FOLDER}-{job.name}"

    def _frame(self, job: Job, task: Task, film: Path | None = None) -> list[Path] | None:
        """Render a frame as Blender would, of a film where there is one; None where it was there."""
        scene, state = bpy.context.scene, self._state(job)
        record = state / f"{_number(task.frame)}.json"
        if not job.again and _is_there(record):
            return None
        if not scene.render.use_overwrite and all(map(os.path.exists, frame_paths(scene, task.frame))):
            return None
        with redirected(scene, state) as target, changed(scene, [("restir.film_from", str(film))] if film else []):
            with nullcontext() if scene.render.engine == "RESTIR" else self._turn(scene.render.threads):
                render_frame(scene, task.frame, target.folder)
            written = target.deliver()
        _write(record, {"files": [(os.path.relpath(path, state), path.stat().st_size) for path in written]})
        return written

    def _samples(self, job: Job, task: Task) -> list[Path] | None:
        """Render a range of a frame's samples into a file of its own; None where it was there."""
        scene, part = bpy.context.scene, _part(self._state(job), task)
        if not job.again and (part.exists() or _is_there(self._state(job) / f"{_number(task.frame)}.json")):
            return None
        samples = [("restir.sample_offset", task.first), ("restir.sample_subset", task.count)]
        with unfinished(self._state(job)) as folder:
            render = [(f"render.{name}", value) for name, value in _RANGE]
            with changed(scene, [*render, ("render.filepath", str(folder / "part")), *samples]):
                render_frame(scene, task.frame, folder)
            check_room(folder)
            found = list(folder.iterdir())
            if len(found) != 1:
                raise NotRendered(f"Blender wrote {len(found)} files of {task}")
            part.parent.mkdir(parents=True, exist_ok=True)
            os.replace(found[0], part)
        return [part]

    def _finish(self, job: Job, task: Task) -> list[Path] | None:
        """Merge a frame's ranges and let Blender make of them what it would have made of the film."""
        from .exr import FileError
        from .merge import merge

        state, folder = self._state(job), _part(self._state(job), task).parent
        if not job.again and _is_there(state / f"{_number(task.frame)}.json"):
            return None
        parts = _parts(folder, bpy.context.scene.restir.samples)
        with unfinished(state) as place:
            film = place / "film.exr"
            try:
                merge(parts, film)
            except FileError as error:
                raise NotRendered(str(error)) from None
            check_room(place)
            written = self._frame(job, task, film)
        if not job.keep_parts:
            shutil.rmtree(folder, ignore_errors=True)
        return written


_KINDS = {FRAME: Renderer._frame, SAMPLES: Renderer._samples, FINISH: Renderer._finish}
SHARED = "the file and all that it needs have to be where every machine of the farm finds them by the same path"


def render_frame(scene: bpy.types.Scene, frame: int, folder: Path) -> None:
    """Render a frame as one of an animation: its handlers, its name, its metadata; folder: where it is written."""
    try:
        if "frame_start" in bpy.ops.render.render.get_rna_type().properties:
            bpy.ops.render.render(animation=True, frame_start=frame, frame_end=frame)
        else:  # before Blender 5
            with changed(scene, [("frame_start", frame), ("frame_end", frame)]):
                bpy.ops.render.render(animation=True)
    except RuntimeError as error:
        check_room(folder)
        lines = dict.fromkeys(line.removeprefix("Error: ") for line in str(error).splitlines() if line)
        raise NotRendered(" ".join(NO_CAMERA if "no camera" in line.lower() else line for line in lines)) from None


@contextmanager
def changed(owner: bpy.types.bpy_struct, values: list[tuple[str, object]]) -> Iterator[None]:
    """Set properties by path where they exist, and set them back, in the same order: some say what others may be."""
    found = []
    for path, value in values:
        *parents, name = path.split(".")
        holder = owner
        for parent in parents:
            holder = getattr(holder, parent)
        if hasattr(holder, name):
            found.append((holder, name, getattr(holder, name), value))
    try:
        for holder, name, _, value in found:
            setattr(holder, name, value)
        yield
    finally:
        for holder, name, value, _ in found:
            setattr(holder, name, value)


@contextmanager
def samples_told(told: Callable[[int], None]) -> Iterator[None]:
    """Call with the number of samples as a render tells it."""

    def handler(line: str, _=None) -> None:
        match = _SAMPLE.search(line) if isinstance(line, str) else None
        if match:
            told(int(match[1]))

    bpy.app.handlers.render_stats.append(handler)
    try:
        yield
    finally:
        bpy.app.handlers.render_stats.remove(handler)


def outside_files() -> list[str]:
    """Absolute paths of what the open file needs beside itself."""
    return sorted({os.path.abspath(path) for path in bpy.utils.blend_paths(absolute=True, packed=False) if path})


def _without(path: str) -> str:
    """What becomes of a file that is nowhere."""
    libraries = {os.path.abspath(bpy.path.abspath(library.filepath)) for library in bpy.data.libraries}
    lost = "what is linked from it is not in the pictures" if path in libraries else "the pictures lack what it holds"
    return f"“{path}” is missing: {lost}. File > External Data > Find Missing Files can find it; then save."


def cautions(scene: bpy.types.Scene, job: Job) -> list[str]:
    """What may look otherwise than on one machine that renders frame after frame."""
    lines = []
    if not job.scripts and any(text.use_module for text in bpy.data.texts):
        lines.append("The file has Python that registers itself, which does not run: --enable-autoexec lets it.")
    simulated = sorted({item.name for item in scene.objects if _is_unbaked(item)})
    world = scene.rigidbody_world
    if world is not None and world.enabled and not world.point_cache.is_baked:
        simulated.append("Rigid Body World")
    if simulated:
        lines.append(
            f"Simulations that are not baked ({', '.join(simulated)}) depend on the frames before: bake them, "
            "since a machine of the farm does not render all frames in their order."
        )
    return lines


def _is_unbaked(item: bpy.types.Object) -> bool:
    """Whether an object has a simulation that no cache holds."""
    caches = [modifier.point_cache for modifier in item.modifiers if hasattr(modifier, "point_cache")]
    caches += [system.point_cache for system in item.particle_systems if system.settings.type == "EMITTER"]
    return any(not cache.is_baked for cache in caches)


def _number(frame: int) -> str:
    return f"frame_{frame:04d}"


def _part(state: Path, task: Task) -> Path:
    """The file of a range of samples; in their order by name."""
    return state / _number(task.frame) / f"samples-{task.first:07d}-{task.first + task.count:07d}.exr"


def _parts(folder: Path, samples: int) -> list[Path]:
    """The files of all ranges of a frame, in their order."""
    found, next_sample = sorted(folder.glob("samples-*.exr")), 0
    for path in found:
        first, end = map(int, path.stem.split("-")[1:])
        if first != next_sample:
            break
        next_sample = end
    if next_sample != samples:
        raise NotHere(f"“{folder}” does not have all of {samples} samples: what follows {next_sample} is not there")
    return found


def _is_there(record: Path) -> bool:
    """Whether a frame's files are as its record says."""
    try:
        files = json.loads(record.read_text("utf-8"))["files"]
        return all((record.parent / path).stat().st_size == size for path, size in files)
    except (OSError, ValueError, KeyError):
        return False


def _write(path: Path, content: dict) -> None:
    """Write a record, whole."""
    with unfinished(path.parent) as folder:
        place = folder / path.name
        place.write_text(json.dumps(content), "utf-8")
        os.replace(place, path)


def version() -> str:
    """What renders here: two of these that differ may render pictures that differ."""
    root = Path(engine.__file__).parents[1]
    try:
        ours = tomllib.loads((root / "blender_manifest.toml").read_text("utf-8"))["version"]
    except (OSError, KeyError, ValueError):
        ours = ""
    return f"Blender {bpy.app.version_string}, ReSTIR {ours}".rstrip()
