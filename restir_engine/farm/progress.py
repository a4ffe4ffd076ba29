"""What the terminal shows of a run: a line for each frame, and below them one that says how far it is."""

from __future__ import annotations

import sys
import time
from datetime import timedelta
from typing import TextIO

from .child import told
from .tasks import SAMPLES, Plan, Task

EVERY = 10.0  # seconds between two lines where the output is no terminal


class Progress:
    """Writes to a stream; the last line is written over where that is a terminal.

    version: what renders; whoever renders with another is named.
    """

    def __init__(self, plan: Plan, version: str = "", stream: TextIO = sys.stdout) -> None:
        self._plan, self._version, self._stream = plan, version, stream
        self._warnings: set[str] = set()
        self._began = self._written = time.monotonic()
        self._terminal = stream.isatty()
        self._shown = ""

    @property
    def warnings(self) -> int:
        """How many there were."""
        return len(self._warnings)

    def tell(self, text: str) -> None:
        """A line that stays."""
        self._stream.write(f"\r\033[K{text}\n" if self._terminal else f"{text}\n")
        self._stream.flush()

    def warn(self, text: str) -> None:
        """A warning, once."""
        if text not in self._warnings:
            self._warnings.add(text)
            self.tell(f"WARNING {text}")

    def show(self, running: dict[Task, int], workers: int) -> None:
        """How far it is; running: samples of tasks that are being rendered."""
        now = time.monotonic()
        text = self.line(running, workers, now)
        if self._terminal:
            self._stream.write(f"\r\033[K{text}")
            self._stream.flush()
        elif now - self._written > EVERY and text != self._shown:
            self._written, self._shown = now, text
            self.tell(text)

    def line(self, running: dict[Task, int], workers: int, now: float) -> str:
        """Frames, samples, remaining time, workers."""
        plan = self._plan
        done = plan.done_samples + sum(min(count, task.count) for task, count in running.items())
        total = plan.total_samples
        parts = [f"Frames {len(plan.written)}/{plan.frames}", f"Samples {done}/{total}"]
        if plan.failures:
            parts.append(f"Failed {len(plan.failures)}")
        if 0 < done < total:
            parts.append(f"Remaining {_clock((now - self._began) * (total - done) / done)}")
        parts.append(f"Workers {workers}" if workers else "Waiting for workers")
        return " | ".join(parts)

    def outcome(self, task: Task, outcome: dict) -> None:
        """What became of a task, where that is of interest: frames, and whatever failed."""
        if not outcome["ok"]:
            word = "AGAIN" if outcome["again"] else "FAILED"
            self.tell(f"{word} {task}, on {outcome['host']}: {told(outcome)}")
        elif task.kind != SAMPLES:
            what = "was there" if outcome["there"] else ", ".join(outcome["written"])
            self.tell(f"Frame {task.frame}: {what} ({outcome['host']}, {outcome['seconds']:.1f} s)")
        for text in outcome["handlers"]:
            self.warn(f"{task}, on {outcome['host']}: a handler of the file failed in {text}")
        for text in outcome.get("warnings", ()):
            self.warn(text)
        version = outcome.get("version", "")
        if version and version != self._version:
            self.warn(f"{outcome['host']} renders with {version}, others with {self._version}")


def _clock(seconds: float) -> str:
    """1:02:03, days before it."""
    return str(timedelta(seconds=round(seconds)))
