"""What could not be rendered as the artist meant it: one entry a datablock and message."""

import logging
from collections import Counter

log = logging.getLogger(__name__)


class Warnings:
    """Messages in the order of their first occurrence, with counts."""

    def __init__(self) -> None:
        self._counts: Counter[tuple[str, str, str]] = Counter()

    def add(self, kind: str, name: str, text: str) -> None:
        """Note that the datablock `name` of `kind` ("Material", "Image", …) has the problem `text`."""
        entry = (kind, name, text)
        if entry not in self._counts:
            log.warning("%s %r: %s", *entry)
        self._counts[entry] += 1

    def __iter__(self):
        return iter(self._counts)

    def __len__(self) -> int:
        return len(self._counts)

    def lines(self) -> list[str]:
        """One readable line an entry."""
        return [f"{kind} “{name}”: {text}" for kind, name, text in self._counts]
