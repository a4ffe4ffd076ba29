"""Where compiled kernels are kept on disk: files by key, in folders that nobody else can write to.

What is kept are pickles, which run code when they are loaded. So a folder or a file that another user could have
written is not read, and a file is compared with the digest at its start before anything looks into it: one that was
cut short or changed is as good as none, and is written again.

Files are looked for in three folders: the one that is configured, a private one among the system's temporary files
where that cannot be written to, and the one that came with the extension.
"""

import contextlib
import errno
import hashlib
import logging
import os
import re
import stat
import tempfile
import time
import uuid
from pathlib import Path

from .sources import ROOT

log = logging.getLogger(__name__)

NAME_LENGTH = 32  # hexadecimal digits of a file's name
SUFFIX_LENGTH = 9  # of a file that is being written
SHIPPED = ROOT / "compiled"
ADVICE = "To change that, set the environment variable RESTIR_CACHE to a folder that you can write to."
_DIGEST = 32  # bytes
_DAY = 86400.0
_OURS = re.compile(rf"[0-9a-f]{{{NAME_LENGTH}}}(\.|$)")


def default_folder() -> Path | None:
    """The folder where none is configured; None where the system names no home."""
    base = os.environ.get("RESTIR_CACHE") or os.environ.get("XDG_CACHE_HOME")
    try:
        return Path(base or Path.home() / ".cache").absolute() / "restir_engine" / "kernels"
    except (RuntimeError, OSError):  # no HOME and no such user; no current directory
        return None


def _private_folder() -> Path | None:
    """A folder of this user alone below the system's temporary files; None where there are none."""
    try:
        return Path(tempfile.gettempdir()).absolute() / f"restir-kernels-{_user()}"
    except OSError:
        return None


def _user() -> int:
    """This user's number; 0 on Windows, where each has temporary files of their own."""
    return os.getuid() if hasattr(os, "getuid") else 0


def _safe(status: os.stat_result) -> bool:
    """Whether nobody but this user and the system's own could have written there. Windows closes users' folders."""
    if not hasattr(os, "getuid"):
        return True
    return status.st_uid in (0, os.getuid()) and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


class Store:
    """The folders in order: `folder`, or None where none is known; `private`; `shipped`, which is only read."""

    def __init__(self, folder: Path | None, private: Path | None, shipped: Path | None) -> None:
        self.folder, self.private, self.shipped = folder, private, shipped
        self._refused: dict[Path, str] = {}  # why a folder cannot be written to, "" where it can
        self._used_private = self._lost = False
        self._usable: dict[Path, bool] = {}

    def read(self, key: str) -> bytes | None:
        """What was written under a key, or None: never, or damaged."""
        for folder in (self.folder, self.private, self.shipped):
            if folder is not None and self._readable(folder):
                payload = _read(folder / key, key, folder == self.shipped)
                if payload is not None:
                    self._used_private |= folder == self.private
                    return payload
        return None

    def has(self, key: str) -> bool:
        """Whether there is a file for a key, which may be damaged."""
        folders = (self.folder, self.private, self.shipped)
        return any(f is not None and self._readable(f) and (f / key).exists() for f in folders)

    def keeps(self) -> bool:
        """Whether something can be written."""
        return any(folder is not None and not self._refusal(folder) for folder in (self.folder, self.private))

    def write(self, key: str, payload: bytes) -> None:
        """Keep `payload` under a key where that is possible."""
        for folder in (self.folder, self.private):
            if folder is None or self._refusal(folder):
                continue
            try:
                _write(folder / key, key, payload)
            except OSError as error:
                self._refused[folder] = error.strerror or str(error)
                log.debug("Kernels cannot be kept in %s: %s", folder, error)
                continue
            self._used_private |= folder == self.private
            return
        self._lost = True

    def problem(self) -> str:
        """A sentence where kernels are not kept as they should be, and what to do; else ""."""
        reason = self._refusal(self.folder) if self.folder else "there is no home folder"
        if not reason or not (self._lost or self._used_private):
            return ""
        where = f"in “{self.folder}” " if self.folder else ""
        when = "time" if self._lost else f"time that “{self.private}” has been emptied"
        return f"compiled kernels cannot be kept {where}({reason}): they are compiled each {when}. {ADVICE}"

    def _refusal(self, folder: Path) -> str:
        """Why a folder cannot be written to; "" where it can, as far as is known."""
        if folder not in self._refused:
            try:
                self._make(folder)
                self._refused[folder] = "" if os.access(folder, os.W_OK) else os.strerror(errno.EROFS)
            except OSError as error:
                self._refused[folder] = error.strerror or str(error)
        return self._refused[folder]

    def remove(self) -> None:
        """Delete everything that was written."""
        self._remove(lambda status: True)

    def remove_old(self, days: float = 30.0) -> None:
        """Delete files that were not used for `days`: those of older versions of the sources."""
        limit = time.time() - days * _DAY
        self._remove(lambda status: status.st_mtime < limit)

    def _remove(self, unwanted) -> None:
        for folder in (self.folder, self.private):
            if folder is None or not self._readable(folder):
                continue
            try:
                for file in os.scandir(folder):
                    if _OURS.match(file.name) and unwanted(file.stat()):
                        os.remove(file)
            except OSError:  # another process was first, or the folder is read-only
                continue

    def _readable(self, folder: Path) -> bool:
        """Whether a folder is there, and safe to read from."""
        if not self._usable.get(folder):
            try:
                status = folder.lstat() if folder == self.private else folder.stat()
            except OSError:
                return False
            # Who can write beside our sources can write those.
            self._usable[folder] = stat.S_ISDIR(status.st_mode) and (folder == self.shipped or _safe(status))
        return self._usable[folder]

    def _make(self, folder: Path) -> None:
        if not self._readable(folder):
            folder.parent.mkdir(parents=True, exist_ok=True)
            folder.mkdir(mode=0o700 if folder == self.private else 0o755, exist_ok=True)
            if not self._readable(folder):
                raise PermissionError(errno.EPERM, "it belongs to another user, or others can write to it")


def _read(path: Path, key: str, shipped: bool = False) -> bytes | None:
    try:
        with open(path, "rb") as file:
            status = os.fstat(file.fileno())
            if not (shipped or _safe(status)):
                return None
            data = file.read()
    except OSError:
        return None
    payload = data[_DIGEST:]
    if _digest(key, payload) != data[:_DIGEST]:
        return None
    if not shipped and status.st_mtime < time.time() - _DAY:
        _touch(path)
    return payload


def _touch(path: Path) -> None:
    """Note on a file that it is in use, for `remove_old`."""
    with contextlib.suppress(OSError):  # it is read-only, or was replaced
        os.utime(path)


def _write(path: Path, key: str, payload: bytes) -> None:
    unfinished = path.with_name(f"{path.name}.{uuid.uuid4().hex[: SUFFIX_LENGTH - 1]}")
    try:
        descriptor = os.open(unfinished, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o644)
        with open(descriptor, "wb") as file:
            file.write(_digest(key, payload) + payload)
        os.replace(unfinished, path)
    except OSError:
        unfinished.unlink(missing_ok=True)
        if _read(path, key) is None:  # Windows replaces no file that another process is reading
            raise


def _digest(key: str, payload: bytes) -> bytes:
    """Of the name as well: a file under another's name is not what it was asked for."""
    return hashlib.sha256(key.encode() + payload).digest()


class _Current:
    store = Store(default_folder(), _private_folder(), SHIPPED)


def configure(folder: Path | None) -> None:
    """Keep compiled kernels in `folder` (None: no such folder is known), unless RESTIR_CACHE names another."""
    if not os.environ.get("RESTIR_CACHE") and folder != _Current.store.folder:
        _Current.store = Store(folder, _private_folder(), SHIPPED)


def store() -> Store:
    """The folders in use."""
    return _Current.store
