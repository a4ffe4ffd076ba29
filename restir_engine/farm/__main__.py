"""Render a file on many machines, or on this one by several Blenders.

    python -m restir_engine.farm scene.blend --frames 1-250
    python -m restir_engine.farm scene.blend --frames 7 --samples-per-task 64 --scheduler tcp://10.0.0.1:8786
    python -m restir_engine.farm --template job.yaml scene.blend --frames 1-250 --samples-per-task 64

What is written is what one machine would have written. See docs/farm.md.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from .tasks import Job, Plan, parse_frames, sample_ranges, spans

INTERRUPTED = 130  # exit code, as shells have it


def parser() -> argparse.ArgumentParser:
    """The command's arguments."""
    found = argparse.ArgumentParser(
        prog="python -m restir_engine.farm", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    found.add_argument("scene", type=Path, help="the .blend, where every machine of the farm finds it")
    found.add_argument("--frames", type=frames, help="such as 1-10,20 or 1-100:5 (default: those of the file)")
    found.add_argument("--samples", type=at_least(0), default=0, metavar="N", help="default: what the file says")
    found.add_argument("--samples-per-task", type=at_least(0), default=0, metavar="N", help="default: whole frames")
    found.add_argument(
        "--output", default="", help="where to, as Blender's --render-output (default: as the file says)"
    )
    found.add_argument("--engine", default="RESTIR", help="default: RESTIR, whatever the file says")
    found.add_argument("--resume", action="store_true", help="do not render again what an earlier run has left")
    found.add_argument("--keep-parts", action="store_true", help="leave the ranges of finished frames on disk")
    found.add_argument("--enable-autoexec", action="store_true", help="let Python in the file run")
    found.add_argument("--blender", default="", help="default: bpy of the worker's Python, or else blender")
    found.add_argument("--threads", type=at_least(0), default=0, help="of each Blender (default: all, by turns)")
    found.add_argument("--tries", type=at_least(1), default=3, help="of a task that a machine fails on (default: 3)")
    found.add_argument("--scheduler", default="", metavar="ADDRESS", help="of a Dask cluster (default: one made here)")
    found.add_argument("--workers", type=at_least(1), default=1, help="of the cluster made here (default: 1)")
    found.add_argument("--dashboard", default="127.0.0.1:8787", metavar="ADDRESS", help="of the cluster made here")
    found.add_argument("--template", type=Path, metavar="FILE", help="write an Open Job Description, and end")
    return found


def at_least(least: int) -> Callable[[str], int]:
    """A number of the command line that is no smaller."""

    def number(text: str) -> int:
        if not text.isdecimal() or int(text) < least:
            raise argparse.ArgumentTypeError(f"“{text}” is no whole number of at least {least}.")
        return int(text)

    return number


def frames(text: str) -> list[int]:
    """Frames of the command line."""
    try:
        return parse_frames(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def absolute(path: str) -> str:
    """A path that means the same on all machines; one that begins with // is beside the .blend."""
    if not path or path.startswith("//"):
        return path
    return os.path.abspath(path) + (os.sep if path.endswith(("/", os.sep)) else "")


def main(arguments: list[str] | None = None) -> int:
    """Render; 0 where every frame is written."""
    options = parser().parse_args(arguments)
    job = Job(
        scene=str(options.scene.absolute()),
        output=absolute(options.output),
        samples=options.samples,
        samples_per_task=options.samples_per_task,
        engine=options.engine,
        scripts=options.enable_autoexec,
        threads=options.threads,
        keep_parts=options.keep_parts,
    )
    if not options.scheduler and not options.scene.is_file():
        print(f"“{options.scene}” is no file: name a .blend.", file=sys.stderr)
        return 1
    if options.template:
        return write_template(job, options)
    try:
        from . import cluster
    except ModuleNotFoundError as error:
        raise SystemExit(f"{error}: the farm needs Dask, which comes with pip install restir-engine[farm]") from None
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with cluster.connected(options.scheduler, options.workers, options.dashboard) as client:
            return render(cluster, client, job, options)
    except KeyboardInterrupt:
        print("\nStopped. What is written stays; --resume goes on from here.", file=sys.stderr)
        return INTERRUPTED
    except cluster.FarmError as error:
        print(error, file=sys.stderr)
        return 1


def write_template(job: Job, options: argparse.Namespace) -> int:
    """Write an Open Job Description, for which a Blender here looks into the file; the exit code."""
    from .child import Child
    from .template import template, write

    child = Child(options.blender)
    facts = child.ask({"do": "facts", "job": job.fields()})
    child.stop()
    if not facts["ok"]:
        print(facts["text"], file=sys.stderr)
        return 1
    job = replace(job, output=job.output if os.path.isabs(job.output) else facts["output"])
    text = template(job, options.frames or facts["frames"], facts["samples"], options.blender, options.template)
    write(options.template, text)
    print(f"{options.template} is written: openjd check {options.template}")
    return 0


def render(cluster, client, job: Job, options: argparse.Namespace) -> int:
    """Render a job by a client's cluster; the exit code."""
    from .progress import Progress

    print(f"Dashboard: {client.dashboard_link}", flush=True)
    if not client.nthreads():
        print(f"Waiting for workers: dask worker {client.scheduler.address} --nthreads 1 starts one", flush=True)
    with cluster.Run(client, job, options.blender) as run:
        facts = run.prepare(options.resume)
        ranges = sample_ranges(facts["samples"], job.samples_per_task)
        plan = Plan(options.frames or facts["frames"], ranges, options.tries)
        progress = Progress(plan, facts["version"])
        tasks = f"{len(ranges)} ranges of {facts['samples']} samples" if len(ranges) > 1 else "one task each"
        progress.tell(f"{job.scene}: {_count(plan.frames, 'frame')}, {tasks}, into {os.path.dirname(facts['path'])}")
        for line in facts["warnings"]:
            progress.warn(line)
        run.render(plan, progress.outcome, progress.show)
    return summary(plan, progress)


def _count(number: int, what: str) -> str:
    return f"{number} {what}" + ("" if number == 1 else "s")


def summary(plan: Plan, progress) -> int:
    """Tell what became of the frames; the exit code."""
    warned = f", {_count(progress.warnings, 'warning')}" if progress.warnings else ""
    progress.tell(f"{len(plan.written)} of {_count(plan.frames, 'frame')} written{warned}.")
    for _, why in sorted(plan.failures.items()):
        progress.tell(f"FAILED {why.partition(chr(10))[0]}")
    if plan.failures:
        progress.tell(f"When that is mended, --frames {spans(plan.failures)} renders these again.")
    return 1 if plan.failures else 0


if __name__ == "__main__":
    sys.exit(main())
