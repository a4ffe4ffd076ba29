"""A Blender of one's own, in a process that renders task after task."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable
from pathlib import Path

from .service import HOST, MARK

KEPT_LINES = 400  # of what Blender prints in the course of a task
TOLD_LINES = 12  # of these, where it fails
START = 300.0  # seconds that Blender may take to be ready
ITS_BLENDER = "--blender names a Blender that has the ReSTIR extension enabled, at the same path on all machines."
_HANDLER = re.compile(r"Error in (bpy\.app\.handlers\.\w+)")
_USUAL = re.compile(r"(^|\| )Read blend: |^scripts disabled for ")  # what Blender tells of a file that it opens


def command(blender: str, *arguments: str) -> list[str]:
    """The command that starts the service: by a Blender, or by this Python where none is named and bpy is installed."""
    if not blender and importlib.util.find_spec("bpy") is None:
        blender = shutil.which("blender") or ""
        if not blender:
            raise OSError("there is none on the path, and no bpy in the worker's Python: say where it is (--blender)")
    if blender:
        return [blender, "--background", "--command", "restir_farm", *arguments]
    return [sys.executable, "-P", "-m", "restir_engine.farm.service", *arguments]


def environment() -> dict[str, str]:
    """Where a Python finds this package."""
    root = str(Path(__file__).resolve().parents[2])
    paths = [root, *filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))]
    return os.environ | {"PYTHONPATH": os.pathsep.join(dict.fromkeys(paths)), "PYTHONUNBUFFERED": "1"}


def detached() -> dict:
    """Arguments of Popen for a process that Ctrl-C in this one's terminal does not reach."""
    return {"start_new_session": True} if os.name == "posix" else {"creationflags": 0x200}


class Child:
    """The process; it is started when something is asked, and again after it has died."""

    def __init__(self, blender: str = "") -> None:
        self._blender = blender
        self._process: subprocess.Popen | None = None
        self._lock = threading.Lock()
        self._stopped = False
        self.greeting: dict = {}
        self.log: deque[str] = deque(maxlen=KEPT_LINES)

    def ask(self, request: dict, tell: Callable[[dict], None] = lambda message: None) -> dict:
        """The outcome of a request. One at a time; a process that dies over it is an outcome as well."""
        with self._lock:
            self._stopped = False
            self.log.clear()
            try:
                if self._process is None or self._process.poll() is not None:
                    self._start()
                self._process.stdin.write(json.dumps(request) + "\n")
                self._process.stdin.flush()
                outcome = self._answer(tell)
            except FileNotFoundError as error:
                text = f"there is no “{error.filename}” on {socket.gethostname()}. {ITS_BLENDER}"
                outcome = {"ok": False, "blame": HOST, "text": f"Blender could not be started: {text}"}
            except OSError as error:
                outcome = {"ok": False, "blame": HOST, "text": f"Blender could not be started: {error}"}
            return outcome | {
                "version": self.greeting.get("version", ""),
                "handlers": handler_errors(self.log),
                "log": [] if outcome["ok"] else list(self.log)[-TOLD_LINES:],
            }

    def stop(self) -> None:
        """End the process, in the middle of a request too; from any thread."""
        self._stopped = True
        process = self._process
        if process is not None:
            process.kill()
            process.wait()

    def _start(self) -> None:
        self._process = subprocess.Popen(
            command(self._blender, "pipe"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env=environment(),
            text=True,
            errors="replace",
            **detached(),
        )
        timer = threading.Timer(START, self._process.kill)
        timer.start()
        try:
            self.greeting = self._answer(lambda message: None)
        finally:
            timer.cancel()
        if not self.greeting.get("ready"):
            raise OSError(f"{self.greeting['text']} before it could render. {ITS_BLENDER}")

    def _answer(self, tell: Callable[[dict], None]) -> dict:
        """Read until an outcome."""
        for line in self._process.stdout:
            if not line.startswith(MARK):
                if line.strip():
                    self.log.append(line.rstrip())
                continue
            message = json.loads(line.removeprefix(MARK))
            if "ok" in message or "ready" in message:
                return message
            tell(message)
        code = self._process.wait()
        self._process.stdout.close()
        text = "the render was stopped" if self._stopped else f"Blender ended {_how(code)}"
        return {"ok": False, "blame": HOST, "text": text, "stopped": self._stopped}


def _how(code: int) -> str:
    """How a process ended, in words."""
    if code >= 0:
        return f"with exit code {code}"
    name = signal.Signals(-code).name if -code in set(signal.Signals) else str(-code)
    return f"by signal {name}" + (
        ", often the system's when memory runs out: let fewer workers render on a machine, or choose one with more"
        if name == "SIGKILL"
        else ""
    )


def handler_errors(lines: deque[str]) -> list[str]:
    """What handlers of the file raised, by what Blender prints of it: the handler and the error's last line."""
    found, handler, last = [], "", ""
    for line in [*lines, "end"]:
        match = _HANDLER.search(line)
        inside = line.startswith((" ", "Traceback", "\t"))
        if handler and not inside:
            last = last or line
            found.append(f"{handler}: {last}")
            handler, last = "", ""
        if match:
            handler, last = match[1], ""
    return found


def told(outcome: dict) -> str:
    """A failure with the last lines that Blender printed."""
    lines = [line for line in outcome.get("log", []) if not _USUAL.search(line)]
    lines = [line for line in dict.fromkeys(lines) if line.removeprefix("Error: ") not in outcome["text"]]
    return "\n    ".join([outcome["text"], *lines])
