"""Locks between processes of a machine: a file that one of them holds, until it lets go or ends in whatever way."""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

POLL = 0.1  # seconds between tries
PATIENCE = 600.0  # seconds after which who holds a lock is taken for stopped

if sys.platform == "win32":
    import msvcrt

    def _lock(file: BinaryIO) -> None:
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _lock(file: BinaryIO) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def take(path: Path) -> BinaryIO | None:
    """The open file that holds a lock until it is closed; None where another process has it, or there is no place."""
    try:
        file = path.open("ab")
    except OSError:
        return None
    try:
        _lock(file)
    except OSError:
        file.close()
        return None
    return file


@contextlib.contextmanager
def held(path: Path, patience: float = PATIENCE) -> Iterator[None]:
    """Hold a lock, once no other process does; without, where there is no place for one or patience (s) ends."""
    end = time.monotonic() + patience
    while (file := take(path)) is None and os.access(path, os.W_OK) and time.monotonic() < end:
        time.sleep(POLL)
    try:
        yield
    finally:
        if file is not None:
            file.close()


def folder() -> Path:
    """Where locks of this machine and user are: among the system's temporary files, not on a disk that others share."""
    user = os.getuid() if hasattr(os, "getuid") else 0
    found = Path(tempfile.gettempdir()) / f"restir-locks-{user}"
    with contextlib.suppress(OSError):
        found.mkdir(mode=0o700, exist_ok=True)
    return found
