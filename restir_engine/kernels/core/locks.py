"""Locks between processes of a machine: a file that one of them holds, until it lets go or ends in whatever way."""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

if sys.platform == "win32":
    import msvcrt

    def _take(file: BinaryIO, wait: bool) -> None:
        while True:
            try:
                return msvcrt.locking(file.fileno(), msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, 1)
            except OSError:  # LK_LOCK gives up after ten seconds
                if not wait:
                    raise

else:
    import fcntl

    def _take(file: BinaryIO, wait: bool) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))


def take(path: Path, wait: bool = False) -> BinaryIO | None:
    """The open file that holds a lock until it is closed; None where another process has it, or there is no place."""
    try:
        file = path.open("ab")
    except OSError:
        return None
    try:
        _take(file, wait)
    except OSError:
        file.close()
        return None
    return file


@contextlib.contextmanager
def held(path: Path) -> Iterator[None]:
    """Hold a lock, once no other process does; where there is no place for one, go on without."""
    file = take(path, wait=True)
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
