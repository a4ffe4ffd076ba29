"""Where a frame is written: beside its place at first, and then, whole, to it.

Blender writes to the path of the scene and of each File Output node of the compositor. While a frame is rendered all
of them lead into a folder of its own, on the same disk; when it is there its files are renamed to where they belong.
"""

from __future__ import annotations

import os
import shutil
import socket
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

from .tasks import UNFINISHED

ROOM = 1 << 20  # bytes that are free on a disk that is not full


class DiskFull(OSError):
    """No room for what a task writes."""


class NoPlace(OSError):
    """A folder that cannot be written to."""


class Redirected:
    """The folder that a frame is written to, and what belongs where: (folder in it, folder that it is for)."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.places: list[tuple[Path, Path]] = []

    def place(self, final: Path) -> Path:
        """A folder for what is to go to `final`."""
        found = self.folder / str(len(self.places))
        found.mkdir(parents=True)
        self.places.append((found, final))
        return found

    def deliver(self) -> list[Path]:
        """Rename everything to where it belongs; the paths that it has then."""
        check_room(self.folder)
        written = []
        for folder, final in self.places:
            for path in sorted(path for path in folder.rglob("*") if path.is_file()):
                target = final / path.relative_to(folder)
                target.parent.mkdir(parents=True, exist_ok=True)
                os.replace(path, target)
                written.append(target)
        return written


@contextmanager
def unfinished(beside: Path) -> Iterator[Path]:
    """A new folder below `beside`, which goes when this ends in whatever way."""
    folder = beside / f"{UNFINISHED}{uuid.uuid4().hex[:8]}"
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        raise NoPlace(
            f"“{beside.parent}” cannot be written to on {socket.gethostname()} ({error.strerror}): choose another "
            "folder with --output or in Output Properties, one that every machine of the farm can write to"
        ) from None
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def redirected(scene: bpy.types.Scene, state: Path) -> Iterator[Redirected]:
    """Let all that Blender writes of a frame go to a folder below `state`."""
    with unfinished(state) as folder:
        found = Redirected(folder)
        before = [(owner, name, getattr(owner, name)) for owner, name, _ in _paths(scene)]
        try:
            for owner, name, is_file in _paths(scene):
                path = getattr(owner, name)
                head, tail = os.path.split(path) if is_file else (path, "")
                final = expanded(scene, head)
                setattr(owner, name, os.path.join(escaped(found.place(final)), tail))
            yield found
        finally:
            for owner, name, value in before:
                setattr(owner, name, value)


def frame_paths(scene: bpy.types.Scene, frame: int) -> set[Path]:
    """Where Blender writes a frame to by the output path: all files of its views."""
    render = scene.render
    each = render.use_multiview and render.image_settings.views_format == "INDIVIDUAL"
    names = [view.name for view in render.views if view.use] if each else [""]
    return {Path(render.frame_path(frame=frame, view=name)) for name in names}


def composited_folders(scene: bpy.types.Scene) -> list[Path]:
    """The folders that File Output nodes write to."""
    paths = [(getattr(owner, name), is_file) for owner, name, is_file in _paths(scene)[1:]]
    return [expanded(scene, os.path.dirname(path) if is_file else path) for path, is_file in paths]


def escaped(path: Path) -> str:
    """A path whose braces are none of Blender's templates."""
    return str(path).replace("{", "{{").replace("}", "}}")


def expanded(scene: bpy.types.Scene, folder: str) -> Path:
    """The absolute path of a folder that Blender writes to, templates in its name filled in."""
    render = scene.render
    before = render.filepath
    try:
        render.filepath = os.path.join(folder or "//", "file")
        return Path(render.frame_path()).parent
    finally:
        render.filepath = before


def _paths(scene: bpy.types.Scene) -> list[tuple[bpy.types.bpy_struct, str, bool]]:
    """(owner, property, whether it names files rather than a folder) of what says where a scene is written to."""
    found: list[tuple[bpy.types.bpy_struct, str, bool]] = [(scene.render, "filepath", True)]
    for node in _output_nodes(_compositor(scene), set()):
        if hasattr(node, "directory"):
            found.append((node, "directory", False))
        else:  # before Blender 5
            found.append((node, "base_path", node.format.file_format == "OPEN_EXR_MULTILAYER"))
    return found


def _compositor(scene: bpy.types.Scene) -> bpy.types.NodeTree | None:
    if not scene.render.use_compositing:
        return None
    if hasattr(scene, "compositing_node_group"):
        return scene.compositing_node_group
    return scene.node_tree if scene.use_nodes else None  # before Blender 5


def _output_nodes(tree: bpy.types.NodeTree | None, seen: set[str]) -> Iterator[bpy.types.Node]:
    if tree is None or tree.name_full in seen:
        return
    seen.add(tree.name_full)
    for node in tree.nodes:
        if node.bl_idname == "CompositorNodeOutputFile":
            yield node
        elif node.bl_idname == "CompositorNodeGroup":
            yield from _output_nodes(node.node_tree, seen)


def check_room(folder: Path) -> None:
    """Raise DiskFull where nothing more could be written: some writers do not tell that they were cut short."""
    if shutil.disk_usage(folder).free < ROOM:
        raise DiskFull(f"the disk of “{folder}” is full on {socket.gethostname()}")
