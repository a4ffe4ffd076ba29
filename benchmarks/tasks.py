"""What is measured in a process of its own: `python -m benchmarks.tasks TASK ARGUMENT…` prints a line of JSON."""

from __future__ import annotations

import ctypes
import json
import os
import sys
import time


def resident_peak() -> int:
    """Most resident memory that this process has had, in bytes."""
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def memory(engine: str) -> dict:
    """What rendering the million triangles adds to the peak of a process that has built them, in bytes."""
    from testing.blender import render

    from . import scenes

    render.register()
    scenes.prepare("diffuse", (16, 16))
    render.render(engine, 1, 0)  # what the engine needs for any scene does not count
    scenes.prepare("million_triangles")
    before = resident_peak()
    render.render(engine, 1, 0)
    return {"added": resident_peak() - before}


def first_pixel(engine: str) -> dict:
    """Seconds of the first render in a process: one sample at 640 × 360, kernels from the cache."""
    from testing.blender import render

    from . import scenes

    render.register()
    scenes.prepare("diffuse")
    start = time.perf_counter()
    render.render(engine, 1, 0)
    return {"seconds": time.perf_counter() - start}


def compilation() -> dict:
    """Seconds of the first renders with an empty cache, and seconds by function without the functions it calls."""
    from numba.core import event

    from testing.blender import render

    from . import scenes

    class Listener(event.Listener):
        """Adds up the time of each function; what is compiled on behalf of another function counts for itself."""

        def __init__(self) -> None:
            self.seconds: dict[str, float] = {}
            self._began: list[float] = []
            self._inner: list[float] = []

        def on_start(self, item) -> None:
            self._inner.append(0.0)
            self._began.append(time.perf_counter())

        def on_end(self, item) -> None:
            function = item.data["dispatcher"].py_func
            name = f"{function.__module__.removeprefix('restir_engine.')}.{function.__name__}"
            total = time.perf_counter() - self._began.pop()
            self.seconds[name] = self.seconds.get(name, 0.0) + total - self._inner.pop()
            if self._inner:
                self._inner[-1] += total

    os.environ["RESTIR_WORKER"] = "1"  # so that kernels are compiled in this process
    listener = Listener()
    event.register("numba:compile", listener)
    render.register()
    first = {}
    for name in ("diffuse", "all_lobes"):
        scenes.prepare(name, (16, 16))
        start = time.perf_counter()
        render.render("RESTIR", 1, 0)
        first[name] = time.perf_counter() - start
    return {"first": first, "functions": sorted(listener.seconds.items(), key=lambda item: -item[1])}


def kernel_seconds(name: str, samples: str, questions: str) -> dict:
    """Seconds that the samples of a scene take without reading the scene and without Blender.

    With 2 questions, kernels ask Embree everything twice: what that takes longer is the time of Embree's queries, a
    little less even, as the second asking finds its nodes in the processor's cache.
    """
    if questions == "2":
        ask_twice()
    import bpy

    from restir_engine import properties
    from restir_engine.session import Session
    from restir_engine.sync.depsgraph import build_scene
    from testing.blender import render

    from . import scenes

    render.register()
    scenes.prepare(name)
    blender_scene = bpy.context.scene
    blender_scene.render.engine = "RESTIR"
    seconds = []
    for count in (1, int(samples), int(samples)):
        blender_scene.restir.samples = count
        settings = properties.render_settings(blender_scene, blender_scene.view_layers[0])
        session = Session(build_scene(bpy.context.evaluated_depsgraph_get(), settings), settings)
        start = time.perf_counter()
        session.render()
        seconds.append(time.perf_counter() - start)
    return {"seconds": min(seconds[1:])}


def ask_twice() -> None:
    """Replace Embree's queries, for kernels that are loaded from now on, by functions that ask twice."""
    import llvmlite.binding
    import numba
    from numba import types

    from restir_engine.embree import library
    from restir_engine.kernels.core.memory import load_u32, store_u32

    loaded = library.load()
    query = types.void(types.int64, types.int64, types.int64)
    far, geometry, instance = 8, 18, 19  # words of Embree's ray-hit record

    def repeat(name: str, hits: bool):
        pointer = ctypes.cast(getattr(loaded, name), ctypes.c_void_p).value
        llvmlite.binding.add_symbol("benchmark_" + name, pointer)
        once = types.ExternalFunction("benchmark_" + name, query)

        def twice(scene, ray, arguments):
            limit = load_u32(ray, far)
            once(scene, ray, arguments)
            store_u32(ray, far, limit)
            if hits:
                store_u32(ray, geometry, library.INVALID)
                store_u32(ray, instance, library.INVALID)
            once(scene, ray, arguments)

        compiled = numba.cfunc(query)(twice)
        llvmlite.binding.add_symbol("restir_" + name, compiled.address)
        return compiled

    KEPT.extend(repeat(name, "Intersect" in name) for name in library.QUERIES)


KEPT: list = []  # compiled functions that other compiled code calls


if __name__ == "__main__":
    task, *arguments = sys.argv[1:]
    result = globals()[task](*arguments)
    print("\n" + json.dumps(result))
    sys.stdout.flush()
    os._exit(0)
