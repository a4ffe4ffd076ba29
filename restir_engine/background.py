"""Compiles what is missing of the kernels while the artist does something else, at the lowest priority.

One process is started some seconds after the extension is enabled; it starts others and leaves a note in the cache
when all kernels are there, so that the next start of Blender does nothing. Blender itself imports nothing for it.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys

import bpy

from . import requirements
from .kernels.core import cache, sources, workers

DELAY = 3.0  # seconds after enabling: Blender has drawn its window and opened its file


class Background:
    """The process, while there is one."""

    process: subprocess.Popen | None = None

    @classmethod
    def start(cls) -> None:
        """Start it where something is missing; kernels of the open scene's integrator come first."""
        missing = not cache.store().has(note())
        if missing and workers.can_start() and cls.process is None and not requirements.problem():
            first = f"integrators.{bpy.context.scene.restir.integrator.lower()}"
            arguments = ["--all", f"--first={first}", f"--note={note()}"]
            nowhere = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            cls.process = workers.start(arguments, idle=True, **nowhere)

    @classmethod
    def stop(cls) -> None:
        """End it; what it has compiled by then is kept."""
        if cls.process is not None:
            cls.process.terminate()
            cls.process.wait()
            cls.process = None


def note() -> str:
    """The key of the note that all kernels of these sources are in the cache."""
    versions = f"{sys.implementation.cache_tag} {requirements.WHEELS}"
    return hashlib.sha256(versions.encode() + sources.digest_of_all()).hexdigest()[: cache.NAME_LENGTH]
