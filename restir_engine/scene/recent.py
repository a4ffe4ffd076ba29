"""Things that are worth keeping for the next frame."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Generic, TypeVar

Value = TypeVar("Value")


class Recent(Generic[Value]):
    """Values by key; those that neither this frame nor the one before has asked for are given up."""

    def __init__(self) -> None:
        self._now: dict[Hashable, Value] = {}
        self._before: dict[Hashable, Value] = {}

    def __len__(self) -> int:
        return len(self._now.keys() | self._before.keys())

    def get(self, key: Hashable) -> Value | None:
        """The value of a key, which this frame is then known to need; None: there is none."""
        if key not in self._now and key in self._before:
            self._now[key] = self._before.pop(key)
        return self._now.get(key)

    def put(self, key: Hashable, value: Value) -> Value:
        """Keep a value, which is given back."""
        self._before.pop(key, None)
        self._now[key] = value
        return value

    def next_frame(self) -> None:
        """Begin a frame: what the last one did not ask for goes."""
        self._now, self._before = {}, self._now
