"""A checkout of the engine that renders on request; `side_by_side` runs one for each build, with PYTHONPATH set to it.

    python benchmarks/turns.py FILE.blend

A line of JSON in is a render {"integrator", "samples", "seed", "picture"}; a line of JSON out, behind MARK, is its
{"seconds", "processor"} (seconds of the wall and of all threads). `picture` is a path to write an EXR to, or null. The
integrator CYCLES is the other engine. It uses nothing but what every version of the engine has: Blender, its operators,
and the names of a few settings.
"""

import json
import os
import resource
import sys
import time

MARK = "\x01"
BOUNCES = 4


def prepare(path: str):
    """Open a file with this checkout's engine, at settings that mean the same to all builds; its scene."""
    import bpy

    from restir_engine import engine

    bpy.ops.wm.open_mainfile(filepath=path)
    engine.register()
    scene = bpy.context.scene
    scene.render.engine = "RESTIR"
    image = scene.render.image_settings
    image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGBA", "32"
    settings = scene.restir
    settings.is_initialized = True
    for name in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces"):
        setattr(settings, name, BOUNCES)
    settings.use_animated_seed = settings.use_denoising = False
    return scene


def render(scene, integrator: str, samples: int, seed: int, picture: str | None) -> dict[str, float]:
    """Seconds of a render of the current scene."""
    import bpy

    scene.render.engine = "CYCLES" if integrator == "CYCLES" else "RESTIR"
    if integrator != "CYCLES":
        scene.restir.integrator = integrator
    for settings in (scene.restir, scene.cycles):
        settings.samples, settings.seed = samples, seed
    scene.render.filepath = picture or ""
    start, processor = time.perf_counter(), time.process_time()
    bpy.ops.render.render(write_still=picture is not None)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {
        "seconds": time.perf_counter() - start,
        "processor": time.process_time() - processor,
        "peak_mib": peak,
    }


def main() -> None:
    """Serve until the input ends."""
    began = time.perf_counter(), time.process_time()
    scene = prepare(sys.argv[1])
    for line in sys.stdin:
        request = json.loads(line)
        result = render(scene, **request)
        result["alive"], result["alive_processor"] = time.perf_counter() - began[0], time.process_time() - began[1]
        print(f"{MARK}{json.dumps(result)}", flush=True)
    sys.stdout.flush()
    os._exit(0)  # bpy 4.5 can hang at a normal exit


if __name__ == "__main__":
    main()
