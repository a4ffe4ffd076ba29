"""What a farm costs and survives: CPU time and pictures beside one plain render; workers that die; a full disk.

    python -m benchmarks.farm still [--size 1280x720] [--samples 256] [--workers 1 2 4]
    python -m benchmarks.farm overhead [--rounds 3]
    python -m benchmarks.farm hosts          workers in network namespaces of their own (root)
    python -m benchmarks.farm killed         a worker is killed by -9 in the middle
    python -m benchmarks.farm lost           the network loses a host in the middle (root)
    python -m benchmarks.farm full           the disk of one worker is full (root)
    python -m benchmarks.farm memory [--frames 200] [--ranges]

CPU time is user and system time of all processes that a command starts, those included that outlive their parents
(PR_SET_CHILD_SUBREAPER); Linux alone has that. The last line of each says whether it went as it should.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

FARM = [sys.executable, "-m", "restir_engine.farm"]
PORT = 8786
SUBREAPER = 36  # of prctl


def output_of(command: list[str]) -> str:
    """What a command prints, which must succeed."""
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode:
        raise SystemExit(f"{' '.join(command)}\n{result.stdout}\n{result.stderr}")
    return result.stdout


def measured(command: list[str]) -> tuple[float, float]:
    """(seconds, seconds of CPU time) of a command and of everything that it starts."""
    before, began = _cpu(), time.perf_counter()
    output_of(command)
    seconds = time.perf_counter() - began
    with contextlib.suppress(ChildProcessError):
        while True:
            os.waitpid(-1, 0)  # those whose parents have ended
    return seconds, _cpu() - before


def _cpu() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def make(file: Path, scene: str, size: str, samples: int, frames: int) -> None:
    """Have a .blend saved by a process of its own."""
    task = [sys.executable, "-m", "benchmarks.farm", "make", "--file", str(file), "--scene", scene]
    output_of([*task, "--size", size, "--samples", str(samples), "--frames", str(frames)])


def save(options: argparse.Namespace) -> None:
    """In that process: save it. Pictures are EXR, so that what is compared is what was rendered."""
    import bpy

    from testing.blender import render

    from . import scenes

    render.register()
    width, height = map(int, options.size.split("x"))
    scenes.prepare(options.scene, (width, height))
    scene = bpy.context.scene
    scene.render.engine = "RESTIR"
    scene.restir.samples, scene.restir.seed = options.samples, 1
    scene.frame_start, scene.frame_end = 1, options.frames
    scene.render.filepath = "//out/frame_"
    turning = next(item for item in scene.objects if item.type == "MESH")
    for frame, angle in ((1, 0.0), (options.frames + 1, 1.0)):
        turning.rotation_euler.z = angle
        turning.keyframe_insert("rotation_euler", frame=frame)
    bpy.ops.wm.save_as_mainfile(filepath=str(options.file))
    sys.stdout.flush()
    os._exit(0)


def plain(options: argparse.Namespace) -> None:
    """In a process of its own: what `blender -b FILE -f 1` does."""
    import bpy

    from testing.blender import render

    render.register()
    bpy.ops.wm.open_mainfile(filepath=str(options.file))
    scene = bpy.context.scene
    scene.render.filepath = str(options.file.parent / "plain" / "frame_")
    scene.frame_end = scene.frame_start
    bpy.ops.render.render(animation=True)
    sys.stdout.flush()
    os._exit(0)


def rendered_plainly(file: Path) -> tuple[float, float, np.ndarray]:
    """(seconds, seconds of CPU time, picture) of one plain render."""
    seconds, cpu = measured([sys.executable, "-m", "benchmarks.farm", "plain", "--file", str(file)])
    return seconds, cpu, picture(file.parent / "plain" / "frame_0001.exr")


def picture(path: Path) -> np.ndarray:
    """The pixels of an EXR file: (height, width, channels)."""
    import OpenEXR

    channels = OpenEXR.File(str(path)).channels()
    return next(iter(channels.values())).pixels.astype(np.float64)


def difference(one: np.ndarray, other: np.ndarray) -> str:
    """How far two pictures are apart, in words."""
    if np.array_equal(one, other):
        return "the same to the last bit"
    return f"greatest relative difference {np.max(np.abs(one - other) / (np.abs(other) + 1e-3)):.1e}"


def still(options: argparse.Namespace, folder: Path) -> bool:
    """A still in ranges on some numbers of workers, beside a plain render."""
    file = folder / "still.blend"
    make(file, options.scene, "32x32", 1, 1)
    rendered_plainly(file)  # kernels are there from now on
    make(file, options.scene, options.size, options.samples, 1)
    seconds, cpu, reference = rendered_plainly(file)
    print(f"plain render           {seconds:7.1f} s  CPU {cpu:7.1f} s", flush=True)
    good = True
    for workers in options.workers:
        command = [*FARM, str(file), "--frames", "1", "--workers", str(workers)]
        command += ["--samples-per-task", str(options.samples // 4)]
        farm_seconds, farm_cpu = measured(command)
        overhead = farm_cpu / cpu - 1.0
        found = difference(picture(folder / "out" / "frame_0001.exr"), reference)
        print(
            f"{workers} workers, 4 ranges    {farm_seconds:7.1f} s  CPU {farm_cpu:7.1f} s  "
            f"overhead {100.0 * overhead:5.1f} %  {found}",
            flush=True,
        )
        good &= overhead <= 0.1
    return good


def overhead(options: argparse.Namespace, folder: Path) -> bool:
    """What a farm takes beside the samples, in seconds of CPU time: medians of plain renders and farms by turns.

    It does not depend on the number of samples, so that few tell, and a busy machine disturbs least.
    """
    file = folder / "still.blend"
    make(file, options.scene, options.size, 4, 1)
    rendered_plainly(file)  # kernels are there from now on
    found: dict[int, list[float]] = {workers: [] for workers in (0, *options.workers)}
    for _ in range(options.rounds):
        for workers, seconds in found.items():
            command = [*FARM, str(file), "--frames", "1", "--workers", str(workers), "--samples-per-task", "1"]
            seconds.append(measured(command)[1] if workers else rendered_plainly(file)[1])
            print(f"{workers} workers  CPU {seconds[-1]:6.1f} s", flush=True)
    plain_seconds = float(np.median(found.pop(0)))
    for workers, seconds in found.items():
        more = float(np.median(seconds)) - plain_seconds
        print(
            f"{workers} workers: {more:.1f} s more than {plain_seconds:.1f} s; 10 % of a render of {10.0 * more:.0f} s"
        )
    return True


@contextlib.contextmanager
def namespaces(count: int) -> Iterator[list[str]]:
    """Hosts of this machine: network namespaces on one bridge, with addresses 10.77.0.1 and so on."""
    names = [f"restir{i}" for i in range(count)]

    def ip(*arguments: str) -> None:
        subprocess.run(["ip", *arguments], check=True)

    try:
        ip("link", "add", "restir-br", "type", "bridge")
        ip("link", "set", "restir-br", "up")
        for i, name in enumerate(names):
            ip("netns", "add", name)
            ip("link", "add", f"veth-r{i}", "type", "veth", "peer", "name", "eth0", "netns", name)
            ip("link", "set", f"veth-r{i}", "master", "restir-br", "up")
            ip("-n", name, "addr", "add", f"10.77.0.{i + 1}/24", "dev", "eth0")
            ip("-n", name, "link", "set", "lo", "up")
            ip("-n", name, "link", "set", "eth0", "up")
        yield names
    finally:
        for name in names:
            subprocess.run(["ip", "netns", "del", name], stderr=subprocess.DEVNULL)
        subprocess.run(["ip", "link", "del", "restir-br"], stderr=subprocess.DEVNULL)


@contextlib.contextmanager
def hosts(workers: int, full: Path | None = None) -> Iterator[tuple[list[str], str]]:
    """(what a command begins with to run on the first host, the scheduler's address); a worker on each of the others.

    full: a folder that is a full disk for the first worker.
    """
    address = f"tcp://10.77.0.1:{PORT}"
    with namespaces(workers + 1) as names, contextlib.ExitStack() as stack, tempfile.TemporaryDirectory() as folder:
        for i, name in enumerate(names):
            script = f"hostname host{i}; "
            if i == 1 and full:
                script += f"mount -t tmpfs -o size=64k full {full}; head -c 60k /dev/zero >{full}/full; "
            kind = "worker" if i else "scheduler"
            command = [sys.executable, "-c", f"from distributed.cli.dask_{kind} import main; main()", "--no-dashboard"]
            command += ["--host", f"10.77.0.{i + 1}"]
            command += [address, "--nthreads", "1", "--local-directory", folder] if i else ["--port", str(PORT)]
            apart = ["ip", "netns", "exec", name, "unshare", "--uts", "--mount", "sh", "-c", script + 'exec "$@"', "-"]
            process = subprocess.Popen([*apart, *command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            stack.callback(lambda p=process: (p.terminate(), p.wait()))
        yield ["ip", "netns", "exec", names[0]], address


def on_hosts(options: argparse.Namespace, folder: Path) -> bool:
    """A still in ranges on two hosts."""
    file = folder / "still.blend"
    make(file, options.scene, options.size, options.samples, 1)
    reference = rendered_plainly(file)[2]
    with hosts(2) as (here, address):
        command = [*here, *FARM, str(file), "--frames", "1", "--scheduler", address]
        began = time.perf_counter()
        print(output_of([*command, "--samples-per-task", str(options.samples // 8)]))
        seconds = time.perf_counter() - began
    found = picture(folder / "out" / "frame_0001.exr")
    print(f"two hosts, 8 ranges: {seconds:.1f} s, {difference(found, reference)}")
    return close(found, reference)


def close(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether ranges have made the picture that one render makes, but for the order of its sums."""
    return bool(np.allclose(one, other, rtol=1e-4, atol=1e-5))


def killed(options: argparse.Namespace, folder: Path) -> bool:
    """A still in ranges on two workers, one of which dies in the middle."""
    file = folder / "still.blend"
    make(file, options.scene, options.size, options.samples, 1)
    reference = rendered_plainly(file)[2]
    command = [*FARM, str(file), "--frames", "1", "--workers", "2", "--samples-per-task", str(options.samples // 8)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    parts = []
    while not parts and process.poll() is None:
        time.sleep(0.2)
        parts = list(folder.glob("out/.restir-farm-*/frame_0001/*.exr"))
    victim = _children(process.pid, "spawn_main")[-1]
    os.kill(victim, signal.SIGKILL)
    print(f"worker {victim} is killed when {len(parts)} of 8 ranges are there")
    print(process.communicate()[0])
    found = picture(folder / "out" / "frame_0001.exr")
    print(f"a worker killed: exit code {process.returncode}, {difference(found, reference)}")
    return process.returncode == 0 and close(found, reference)


def lost(options: argparse.Namespace, folder: Path) -> bool:
    """A still in ranges on two hosts, one of which the network loses in the middle."""
    file = folder / "still.blend"
    make(file, options.scene, options.size, options.samples, 1)
    reference = rendered_plainly(file)[2]
    with hosts(2) as (here, address):
        time.sleep(5.0)  # both are there
        command = [*here, *FARM, str(file), "--frames", "1", "--scheduler", address]
        command += ["--samples-per-task", str(options.samples // 8)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        while not list(folder.glob("out/.restir-farm-*/frame_0001/*.exr")) and process.poll() is None:
            time.sleep(0.2)
        subprocess.run(["ip", "-n", "restir2", "link", "set", "eth0", "down"], check=True)
        print(process.communicate()[0])
    found = picture(folder / "out" / "frame_0001.exr")
    print(f"a host lost: exit code {process.returncode}, {difference(found, reference)}")
    return process.returncode == 0 and close(found, reference)


def _children(parent: int, text: str) -> list[int]:
    """Processes of a parent whose command line has a text."""
    found = subprocess.run(["pgrep", "-P", str(parent), "-f", text], capture_output=True, text=True).stdout
    return [int(line) for line in found.split()]


def full_disk(options: argparse.Namespace, folder: Path) -> bool:
    """An animation on two hosts, for one of which the pictures' disk is full."""
    file, out = folder / "animation.blend", folder / "out"
    make(file, options.scene, options.size, options.samples, 4)
    out.mkdir()
    reference = rendered_plainly(file)[2]
    with hosts(2, full=out) as (here, address):
        time.sleep(5.0)  # both are there
        output = output_of([*here, *FARM, str(file), "--scheduler", address])
    print(output)
    found = picture(out / "frame_0001.exr")
    print(f"a full disk: {difference(found, reference)}, {len(list(out.glob('frame_*.exr')))} of 4 frames")
    return np.array_equal(found, reference) and len(list(out.glob("frame_*.exr"))) == 4 and "is full" in output


def memory(options: argparse.Namespace, folder: Path) -> bool:
    """How the memory of a worker's Blender grows with the frames that it renders."""
    from restir_engine.farm.child import Child
    from restir_engine.farm.tasks import FINISH, FRAME, SAMPLES, Job, Task

    file = folder / "animation.blend"
    make(file, options.scene, "64x64", 4, options.frames)
    child, job = Child(), Job(str(file), samples_per_task=2 if options.ranges else 0)
    facts = child.ask({"do": "facts", "job": job.fields()})
    job = Job.of(job.fields() | {"digest": facts["digest"]})
    found = []
    for frame in facts["frames"]:
        tasks = [Task(FRAME, frame, 0, 4)]
        if options.ranges:
            tasks = [Task(SAMPLES, frame, 0, 2), Task(SAMPLES, frame, 2, 2), Task(FINISH, frame)]
        for task in tasks:
            outcome = child.ask({"do": "task", "job": job.fields(), "task": task.fields()})
        found.append(outcome["memory"] / 2**20)
    child.stop()
    rest = np.polyfit(np.arange(len(found) // 2), found[-(len(found) // 2) :], 1)[0]
    growth = (found[-1] - found[0]) / (len(found) - 1)
    print(f"{len(found)} frames: {found[0]:.1f} MB after the first, {found[len(found) // 2]:.1f} MB after half,")
    print(f"{found[-1]:.1f} MB after the last: {growth:.4f} MB a frame; over the second half {rest:.4f} MB a frame")
    return growth < 0.2


COMMANDS = {
    "still": still,
    "overhead": overhead,
    "hosts": on_hosts,
    "killed": killed,
    "lost": lost,
    "full": full_disk,
    "memory": memory,
}
PARTS = {"make": save, "plain": plain}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=[*COMMANDS, *PARTS])
    parser.add_argument("--scene", default="all_lobes", help="one of benchmarks/scenes.py")
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--ranges", action="store_true", help="memory: of frames that are made of two ranges each")
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2, 4])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--file", type=Path)
    options = parser.parse_args()
    if options.what in PARTS:
        PARTS[options.what](options)
        return
    ctypes.CDLL(None).prctl(SUBREAPER, 1, 0, 0, 0)
    with tempfile.TemporaryDirectory() as folder:
        good = COMMANDS[options.what](options, Path(folder))
    print("as it should be" if good else "NOT as it should be")
    sys.exit(not good)


if __name__ == "__main__":
    main()
