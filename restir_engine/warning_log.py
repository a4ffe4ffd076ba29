"""The warnings of each scene's last render, for the Warnings panel.

They are kept beside the file's data, not in it: a render must not write to the scene that the window is drawing.
"""

_LINES: dict[str, tuple[str, ...]] = {}
_SAID: set[str] = set()  # in the renders of one job: view layers, frames


def record(scene: str, lines: list[str]) -> None:
    """Replace the warnings of a scene by those of the render that has just ended."""
    _LINES[scene] = tuple(lines)
    _SAID.update(lines)


def end_job() -> int:
    """How many warnings there were in all renders since this was last asked."""
    count = len(_SAID)
    _SAID.clear()
    return count


def add(scene: str, lines: list[str]) -> None:
    """Add warnings that are not there yet."""
    known = _LINES.get(scene, ())
    _LINES[scene] = (*known, *[line for line in lines if line not in known])


def lines(scene: str) -> tuple[str, ...]:
    """The warnings of a scene, one readable line each."""
    return _LINES.get(scene, ())


def clear() -> None:
    """Forget everything: another file was opened."""
    _LINES.clear()
