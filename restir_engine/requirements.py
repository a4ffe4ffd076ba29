"""The Python packages the engine needs beside Blender's own NumPy, whether they are there, and who replaced them."""

import importlib.util
import tomllib
from importlib import metadata
from pathlib import Path

# Exactly these are shipped as wheels; pyproject.toml names the same.
WHEELS = {"numba": "0.68.1", "llvmlite": "0.50.0", "embreex": "4.4.0.post1", "openexr": "3.5.3"}
# What a render does without: farm/exr.py, which merges renders, says where it is missing.
FOR_MERGING = {"openexr"}

# How many leading numbers of a newer version must be the same: what they have inside changes with the next.
SERIES = {"numba": 2, "llvmlite": 2, "embreex": 1}

_ROOT = Path(__file__).resolve().parents[1]
_INSTALL = "install the ReSTIR zip that was built for this Blender version and platform again"


def problem() -> str:
    """What is wrong with the installed packages and what to do, or "".

    All extensions share one folder of packages in which the newest version wins, so another extension can have
    replaced what ours brought.
    """
    for package, version in WHEELS.items():
        if package in FOR_MERGING:
            continue
        try:
            found = metadata.version(package)
        except metadata.PackageNotFoundError:
            return (
                f"The Python package “{package}” is missing. Install the ReSTIR zip that was built for this "
                "Blender version and platform through Preferences > Get Extensions > Install from Disk."
            )
        series = SERIES.get(package, 1)
        if _release(found) < _release(version):
            return f"{_differs(package, found, version)}: update or disable that, then {_INSTALL}."
        if _release(found)[:series] > _release(version)[:series]:
            return f"{_differs(package, found, version)}: update ReSTIR, or disable that and {_INSTALL}."
    return ""


def _differs(package: str, found: str, version: str) -> str:
    return f"The Python package “{package}” is {found}, but ReSTIR needs {version}. It comes from {_origin(package)}"


def _origin(package: str) -> str:
    """Who brought a package: other extensions, by their manifests, or else the folder that it is in."""
    names = sorted(name for manifest in _manifests() if (name := _brings(manifest, package)))
    if names:
        return "the extension " + " or ".join(f"“{name}”" for name in names)
    spec = importlib.util.find_spec(package)
    return f"“{Path(spec.origin).parent.parent}”" if spec and spec.origin else "elsewhere"


def _manifests() -> list[Path]:
    """The manifests of the other extensions in all repositories, if this is one: extensions/REPOSITORY/EXTENSION/."""
    if _ROOT.parent.parent.name != "extensions":
        return []
    return [path for path in _ROOT.parent.parent.glob("*/*/blender_manifest.toml") if path.parent != _ROOT]


def _brings(manifest: Path, package: str) -> str:
    """The name of an extension if there is a wheel of a package in it, else ""."""
    try:
        content = tomllib.loads(manifest.read_text("utf-8"))
    except (OSError, ValueError):  # of somebody else, and broken
        return ""
    wheels = [str(wheel).replace("\\", "/").rpartition("/")[2] for wheel in content.get("wheels", [])]
    return str(content.get("name", manifest.parent.name)) if any(w.startswith(package + "-") for w in wheels) else ""


def _release(version: str) -> tuple[int, ...]:
    """The leading numbers of a version: (4, 4, 0) for "4.4.0.post1"."""
    numbers = []
    for part in version.split("."):
        if not part.isdigit():
            break
        numbers.append(int(part))
    return tuple(numbers)
