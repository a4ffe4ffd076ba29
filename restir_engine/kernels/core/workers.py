"""Processes that compile kernels into the cache, as many as the machine has cores, while this one waits or goes on.

What LLVM takes of memory while it compiles is given back when they end. They run the Python of this process, read the
names of kernels from their standard input and answer each with a line. Where there is no such Python, or nothing can
be kept on disk, nothing happens here: whoever needs a kernel compiles it.
"""

import importlib.util
import itertools
import os
import queue
import subprocess
import sys
import threading
from concurrent.futures import Future
from pathlib import Path

from ...requirements import WHEELS
from . import cache
from .sources import ROOT

IDLE_SECONDS = 5.0  # after which a process without work ends
_MODULE = f"{ROOT.name}.kernels.core.worker"


def python() -> str | None:
    """The Python to start; None where an application has one inside that cannot be started."""
    return sys.executable if sys.executable and "python" in Path(sys.executable).stem.lower() else None


def command(*arguments: str) -> list[str]:
    """The command that starts a worker. Its package is named as it stands on disk: files in the cache hold no name.

    Nothing is imported from the current folder (-P), which may hold anything, another checkout of this package too.
    """
    return [python(), "-P", "-m", _MODULE, *arguments]


def start(arguments: list[str], idle: bool = False, **streams) -> subprocess.Popen:
    """Start a worker, without a window; idle: at the lowest priority."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(_paths()), "PYTHONDONTWRITEBYTECODE": "1"}
    environment["RESTIR_WORKER"] = "1"  # it starts none itself
    arguments = [*arguments, f"--folder={cache.store().folder or ''}"]
    if sys.platform == "win32":
        priority = subprocess.IDLE_PRIORITY_CLASS if idle else 0
        streams["creationflags"] = subprocess.CREATE_NO_WINDOW | priority
    elif idle:
        arguments = [*arguments, "--idle"]
    return subprocess.Popen(command(*arguments), env=environment, **streams)


def _paths() -> list[str]:
    """The folders that a worker imports from: the one with this package, those with what it needs."""
    found = [importlib.util.find_spec(name) for name in ("numpy", *WHEELS)]
    folders = [Path(spec.origin).parent.parent for spec in found if spec is not None and spec.origin]
    return list(dict.fromkeys(map(str, [ROOT.parent, *folders])))


class Workers:
    """Up to `count` processes and one queue; those who are waited for come first."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._queue: queue.PriorityQueue = queue.PriorityQueue()
        self._order = itertools.count()
        self._futures: dict[str, Future] = {}
        self._threads = 0
        self._lock = threading.Lock()
        self._waiting = False

    def submit(self, names: list[str], urgent: bool) -> list[Future]:
        """A future for each kernel, by name: whether it was compiled."""
        with self._lock:
            for name in names:
                future = self._futures.get(name)
                if future is None or (urgent and not future.running() and not future.done()):
                    future = self._futures.setdefault(name, Future())
                    self._queue.put((0 if urgent else 1, next(self._order), name))
            for _ in range(min(len(names), self._count) - self._threads):
                self._threads += 1
                threading.Thread(target=self._serve, name="restir-compile", daemon=True).start()
            return [self._futures[name] for name in names]

    @property
    def progress(self) -> tuple[int, int]:
        """How many kernels are compiled, of how many that were asked for; (0, 0) while nobody waits."""
        with self._lock:
            futures = list(self._futures.values())
        return (sum(future.done() for future in futures), len(futures)) if self._waiting else (0, 0)

    def wait(self, futures: list[Future]) -> None:
        """Return when these are done."""
        self._waiting = True
        try:
            for future in futures:
                future.result()
        finally:
            self._waiting = False

    def _serve(self) -> None:
        process = None
        try:
            while True:
                try:
                    name = self._queue.get(timeout=IDLE_SECONDS)[2]
                except queue.Empty:
                    with self._lock:
                        if self._queue.empty():
                            self._threads -= 1
                            return
                    continue
                future = self._futures[name]
                with self._lock:
                    if future.running() or future.done():
                        continue
                    future.set_running_or_notify_cancel()
                process, done = _ask(process, name)
                future.set_result(done)
        finally:
            if process is not None:
                process.stdin.close()
                process.wait()


def _ask(process: subprocess.Popen | None, name: str) -> tuple[subprocess.Popen | None, bool]:
    """Have a kernel compiled by a process, which is started where there is none; (it, whether that went well)."""
    try:
        process = process or start([], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        process.stdin.write(name + "\n")
        process.stdin.flush()
        answer = process.stdout.readline()
    except OSError:
        answer = ""
    return (process, answer == "done\n") if answer else (None, False)


_WORKERS = Workers(os.cpu_count() or 1)


def begin(names: list[str]) -> list[Future]:
    """Compile these in the background."""
    return _WORKERS.submit(names, urgent=False) if can_start() else []


def compile_all(names: list[str]) -> None:
    """Compile these and wait for it."""
    ours = [name for name in names if (ROOT / Path(*name.partition(":")[0].split("."))).with_suffix(".py").exists()]
    if ours and can_start():
        _WORKERS.wait(_WORKERS.submit(ours, urgent=True))


def progress() -> tuple[int, int]:
    """How many kernels are compiled, of how many that were asked for; (0, 0) while nobody waits."""
    return _WORKERS.progress


def can_start() -> bool:
    """Whether there is a Python to start, and room for what it compiles; a worker starts none itself."""
    return python() is not None and cache.store().keeps() and "RESTIR_WORKER" not in os.environ
