"""The Python packages the engine needs beside Blender's own NumPy, and whether they are there."""

from importlib import metadata

# Exactly these are shipped as wheels; pyproject.toml names the same.
WHEELS = {"numba": "0.68.1", "llvmlite": "0.50.0", "embreex": "4.4.0.post1"}


def problem() -> str:
    """What is wrong with the installed packages and what to do, or "".

    All extensions share one folder of packages in which the newest version wins, so another extension can have
    replaced what ours brought.
    """
    for package, version in WHEELS.items():
        try:
            found = metadata.version(package)
        except metadata.PackageNotFoundError:
            return (
                f"The Python package “{package}” is missing. Install the ReSTIR zip that was built for this "
                "Blender version and platform through Preferences > Get Extensions > Install from Disk."
            )
        if _release(found) < _release(version):
            return (
                f"The Python package “{package}” is {found}, but ReSTIR needs {version}. Another extension brings the "
                "older one: update or disable that extension, then install the ReSTIR zip again."
            )
    return ""


def _release(version: str) -> tuple[int, ...]:
    """The leading numbers of a version: (4, 4, 0) for "4.4.0.post1"."""
    numbers = []
    for part in version.split("."):
        if not part.isdigit():
            break
        numbers.append(int(part))
    return tuple(numbers)
