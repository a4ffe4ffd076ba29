"""What a farm renders, cut into tasks: whole frames, or ranges of a frame's samples and what makes a frame of them.

Pure Python: who renders the tasks, and where, is told by `Plan` what comes next and tells it what became of it.
"""

from __future__ import annotations

import hashlib
import re
from collections import deque
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

FRAME, SAMPLES, FINISH = "FRAME", "SAMPLES", "FINISH"  # kinds of tasks
UNFINISHED = "unfinished-"  # how folders are called whose files have no name of their own yet
_SPAN = re.compile(r"(-?\d+)(?:(?:-|\.\.)(-?\d+)(?::(\d+))?)?")
_BLOCK = 1 << 20  # bytes read at once


@dataclass(frozen=True)
class Job:
    """What all tasks have in common. It travels as the dictionary of its fields."""

    scene: str  # the .blend, by a path that all machines share
    output: str = ""  # as Blender's -o; "": what the file says
    samples: int = 0  # 0: what the file says
    samples_per_task: int = 0  # 0: whole frames
    engine: str = "RESTIR"  # as Blender's -E
    scripts: bool = False  # whether Python in the file may run, as Blender's --enable-autoexec
    threads: int = 0  # of each renderer; 0: all of its machine, whose renderers take turns
    cores: int = 0  # of the machine; 0: as the system says
    keep_parts: bool = False  # whether ranges stay on disk when a frame has been made of them
    again: bool = False  # whether what is there is rendered all the same
    digest: str = ""  # of the .blend; "": not known yet
    files: tuple[str, ...] = ()  # what else the .blend needs, as the first machine saw it

    @classmethod
    def of(cls, fields: dict) -> Job:
        """The job of a dictionary."""
        return cls(**fields | {"files": tuple(fields.get("files", ()))})

    def fields(self) -> dict:
        """The dictionary of a job."""
        return asdict(self)

    @property
    def name(self) -> str:
        """What its unfinished files are found by: another file or other settings have another name.

        Paths do not count, which may differ from machine to machine where a farm translates them.
        """
        name = Path(self.output).name
        told = (self.digest, name, self.samples, self.samples_per_task, self.engine, self.scripts)
        return hashlib.blake2b(repr(told).encode(), digest_size=6).hexdigest()


@dataclass(frozen=True)
class Task:
    """A frame, or the samples [first, first + count) of one, or what makes a frame of its ranges."""

    kind: str
    frame: int
    first: int = 0
    count: int = 0

    def __str__(self) -> str:
        if self.kind == SAMPLES:
            return f"frame {self.frame}, samples {self.first + 1} to {self.first + self.count}"
        return f"frame {self.frame}" + (", made of its ranges" if self.kind == FINISH else "")

    def fields(self) -> dict:
        """The dictionary of a task."""
        return asdict(self)


def parse_frames(text: str) -> list[int]:
    """Frames in the order of their text: "1-10,20,30-40:2"; Blender's 1..10 for 1-10.

    Each frame comes once.
    """
    frames = []
    for part in text.replace(" ", "").split(","):
        match = _SPAN.fullmatch(part)
        if match is None:
            raise ValueError(f"“{part}” is no frame and no range of frames such as 1-10 or 1-100:5.")
        start, end, step = (int(group) if group else None for group in match.groups())
        end = start if end is None else end
        if end < start or step == 0:
            raise ValueError(f"The frames “{part}” lead nowhere: write the smaller number first, and a step above 0.")
        frames += range(start, end + 1, step or 1)
    return list(dict.fromkeys(frames))


def spans(frames: Iterable[int]) -> str:
    """Frames as text, in order, what follows one another as a range."""
    found: list[list[int]] = []
    for frame in sorted(frames):
        if found and found[-1][1] == frame - 1:
            found[-1][1] = frame
        else:
            found.append([frame, frame])
    return ",".join(str(first) if first == last else f"{first}-{last}" for first, last in found)


def sample_ranges(samples: int, per_task: int) -> list[tuple[int, int]]:
    """(first, count) of ranges of at most `per_task` samples; one of all where that is 0."""
    if per_task <= 0:
        return [(0, samples)]
    return [(first, min(per_task, samples - first)) for first in range(0, samples, per_task)]


def digest_of(path: Path) -> str:
    """Of what is in a file."""
    found = hashlib.blake2b(digest_size=16)
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            found.update(block)
    return found.hexdigest()


class Plan:
    """Which tasks are left, how often each was tried, and what became of the frames.

    ranges: (first, count) of a frame's ranges of samples; a single one is rendered as a whole frame.
    """

    def __init__(self, frames: list[int], ranges: list[tuple[int, int]], tries: int = 3) -> None:
        self._tries = tries
        self._samples = sum(count for _, count in ranges)
        self._left = {frame: len(ranges) for frame in frames}  # ranges that are not there
        self._waiting: deque[Task] = deque()
        self._attempts: dict[Task, int] = {}
        self.avoid: dict[Task, set[str]] = {}  # workers that a task failed on for no fault of its own
        self.failures: dict[int, str] = {}  # frame → why it is not written
        self.written: list[int] = []
        self._done = dict.fromkeys(frames, 0)  # samples
        kind = FRAME if len(ranges) == 1 else SAMPLES
        for frame in frames:
            self._waiting += [Task(kind, frame, first, count) for first, count in ranges]

    def next(self) -> Task | None:
        """A task to be rendered now; None where there is none to be begun."""
        while self._waiting:
            task = self._waiting.popleft()
            if task.frame not in self.failures:
                return task
        return None

    def done(self, task: Task) -> None:
        """A task has been rendered. What finishes a frame comes before what begins another."""
        self._done[task.frame] += task.count
        if task.kind in (FRAME, FINISH):
            self.written.append(task.frame)
            return
        self._left[task.frame] -= 1
        if not self._left[task.frame]:
            self._waiting.appendleft(Task(FINISH, task.frame))

    def failed(self, task: Task, why: str, elsewhere: bool, worker: str = "") -> bool:
        """A task has failed; whether it is tried again.

        elsewhere: it may do better on another machine than the worker's.
        """
        self._attempts[task] = self._attempts.get(task, 0) + 1
        if elsewhere and self._attempts[task] < self._tries and task.frame not in self.failures:
            if worker:
                self.avoid.setdefault(task, set()).add(worker)
            self._waiting.appendleft(task)
            return True
        self.failures.setdefault(task.frame, why)
        return False

    @property
    def frames(self) -> int:
        """How many there are."""
        return len(self._left)

    @property
    def ended(self) -> bool:
        """Whether every frame is written or has failed."""
        return len(self.written) + len(self.failures) == len(self._left)

    @property
    def total_samples(self) -> int:
        """Samples of all frames."""
        return self._samples * len(self._left)

    @property
    def done_samples(self) -> int:
        """Samples of all tasks that are done; nothing is left to do of a frame that has failed."""
        return sum(self._samples if frame in self.failures else done for frame, done in self._done.items())
