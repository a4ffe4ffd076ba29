"""What scripts that run in Blender's window share: steps on a timer, a log, screenshots."""

from __future__ import annotations

import gc
import shutil
import subprocess
import time
import traceback
from collections.abc import Callable, Generator
from pathlib import Path

import bpy


class Log:
    """Lines that are there at once, in a file of a folder."""

    def __init__(self, path: Path) -> None:
        self.folder = path.parent
        self._file = path.open("w")

    def __call__(self, text: str) -> None:
        """Write a line."""
        print(text, file=self._file, flush=True)

    def screenshot(self, name: str) -> None:
        """Save what is on the screen beside the log."""
        path = str(self.folder / f"{name}.png")
        if shutil.which("import"):
            subprocess.run(["import", "-window", "root", path], check=True)
        else:
            bpy.ops.screen.screenshot(filepath=path)


def live_sessions() -> list:
    """The live sessions of all 3D views."""
    return [item for item in gc.get_objects() if type(item).__name__ == "LiveSession" and not item._closed]


def until(condition: Callable[[], object], seconds: float, every: float = 0.1):
    """Wait until something is so; it has to be within this time."""
    started = time.monotonic()
    while not condition():
        assert time.monotonic() - started < seconds, f"not within {seconds} s"
        yield every


def areas(kind: str) -> list[bpy.types.Area]:
    """The areas of one kind in the first window."""
    return [area for area in bpy.context.window_manager.windows[0].screen.areas if area.type == kind]


def window_region(area: bpy.types.Area) -> bpy.types.Region:
    """The region of an area that shows what it is for."""
    return next(region for region in area.regions if region.type == "WINDOW")


def run(steps: Generator[float, None, None], log: Log) -> None:
    """Run a script: a generator that yields the seconds to wait before its next step. Blender quits at its end."""

    def step() -> float | None:
        try:
            return next(steps)
        except StopIteration:
            log("finished")
        except BaseException:
            log(traceback.format_exc())
        bpy.ops.wm.quit_blender()
        return None

    bpy.app.timers.register(step, first_interval=2.0, persistent=True)
