"""Build the extension's zip, the wheels it needs inside.

    python -m tools.build --blender 5.2 --platform linux-x64
    python -m tools.build --blender 4.5 5.2 --platform windows-x64      # one zip for both
    python -m tools.build --python 3.14                                 # a Blender that runs on the system's Python

Wheels are kept in wheels/ and downloaded once; the zip is written to dist/. Kernels are compiled for the baseline of
this platform's processors (`compiled.BASELINES`) by each of the Pythons that is here with the engine's packages; on
other platforms, and for other Pythons, the zip has none and they are compiled where it is installed.
"""

import argparse
import os
import platform as machine
import shutil
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from pathlib import Path

from restir_engine.kernels.core import cache
from restir_engine.kernels.core.compiled import baseline
from restir_engine.requirements import WHEELS

ROOT = Path(__file__).resolve().parent.parent

# The Python inside each supported Blender.
PYTHON_OF_BLENDER = {"4.5": "3.11", "5.0": "3.11", "5.1": "3.13", "5.2": "3.13"}

# Wheel tags that run on each of Blender's platforms, the newest first.
WHEEL_TAGS = {
    "linux-x64": ("manylinux_2_28_x86_64", "manylinux_2_27_x86_64", "manylinux_2_17_x86_64", "manylinux2014_x86_64"),
    "windows-x64": ("win_amd64",),
    "macos-arm64": ("macosx_14_0_arm64", "macosx_12_0_arm64", "macosx_11_0_arm64"),
}

FOLDERS = ("restir_engine", "operators", "ui")
FILES = ("__init__.py", "LICENSE")
SUFFIXES = {".py", ".npy", ".npz"}


def download(python: str, platform: str, folder: Path) -> list[Path]:
    """The wheels for one Python version and platform, downloaded to `folder` where they are not there yet."""
    target = folder / f"{platform}-{python}"
    packages = [f"{name}=={version}" for name, version in WHEELS.items()]
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--only-binary=:all:"]
    command += ["--dest", str(target), "--python-version", python, "--implementation", "cp"]
    for tag in WHEEL_TAGS[platform]:
        command += ["--platform", tag]
    if not all(list(target.glob(f"{name}-{version}-*.whl")) for name, version in WHEELS.items()):
        print(f"Downloading wheels for Python {python} on {platform}", flush=True)
        subprocess.run(command + packages, check=True)
    return [next(target.glob(f"{name}-{version}-*.whl")) for name, version in WHEELS.items()]


def manifest(platform: str, wheels: list[Path]) -> str:
    """The manifest of a zip: the repository's, its platform and its wheels."""
    lines = [(ROOT / "blender_manifest.toml").read_text().partition("\n# `python -m tools.build`")[0]]
    lines.append(f'platforms = ["{platform}"]')
    lines.append("wheels = [")
    lines += [f'    "./wheels/{wheel.name}",' for wheel in wheels]
    lines.append("]\n")
    return "\n".join(lines)


def sources() -> list[Path]:
    """The files of the repository that the extension consists of."""
    found = [ROOT / name for name in FILES]
    for folder in FOLDERS:
        found += [path for path in (ROOT / folder).rglob("*") if path.suffix in SUFFIXES]
    return sorted(found)


def this_platform() -> str:
    """The name in WHEEL_TAGS of the platform that this runs on, or ""."""
    names = {("linux", "x86_64"): "linux-x64", ("win32", "AMD64"): "windows-x64", ("darwin", "arm64"): "macos-arm64"}
    return names.get((sys.platform, machine.machine()), "")


def interpreter(python: str) -> str | None:
    """A Python of this version that has the engine's packages: this one, that of the tests, the system's; or None."""
    wanted = f"{python} {WHEELS['numba']} {WHEELS['llvmlite']}"
    report = (
        "import sys, numba, llvmlite; print('%d.%d' % sys.version_info[:2], numba.__version__, llvmlite.__version__)"
    )
    folder = ROOT / f".venv-{python.replace('.', '')}"
    for path in (sys.executable, folder / "bin" / "python", shutil.which(f"python{python}")):
        if path and Path(path).exists():
            result = subprocess.run([path, "-c", report], capture_output=True, text=True)
            if result.stdout.strip() == wanted:
                return str(path)
    return None


def compile_kernels(python: str, platform: str, folder: Path) -> list[Path]:
    """Files of the engine's kernels, compiled below `folder` for one Python version; none where that cannot be."""
    found = interpreter(python) if platform == this_platform() else None
    if found is None:
        print(f"No kernels compiled ahead for Python {python} on {platform}: there is none with Numba here", flush=True)
        return []
    processor, features = baseline()
    environment = os.environ | {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": features}
    environment |= {"RESTIR_CACHE": str(folder), "TMPDIR": str(folder), "PYTHONPATH": str(ROOT)}
    print(f"Compiling kernels for Python {python} and {processor}", flush=True)
    command = [found, "-m", "restir_engine.kernels.core.worker", "--all"]
    names = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True).stdout.split()
    return [folder / "restir_engine" / "kernels" / name for name in names]


def build(pythons: list[str], platform: str, label: str, out: Path) -> Path:
    """Write the zip for these Python versions and this platform; returns its path."""
    wheels = sorted({wheel for python in pythons for wheel in download(python, platform, ROOT / "wheels")})
    text = manifest(platform, wheels)
    version = tomllib.loads(text)["version"]
    out.mkdir(parents=True, exist_ok=True)
    path = out / f"restir_engine-{version}-{label}-{platform}.zip"
    with tempfile.TemporaryDirectory(dir=out) as folder:
        unfinished = Path(folder) / path.name
        kernels = [kernel for python in pythons for kernel in compile_kernels(python, platform, Path(folder))]
        with zipfile.ZipFile(unfinished, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("blender_manifest.toml", text)
            for source in sources():
                archive.write(source, source.relative_to(ROOT))
            for kernel in kernels:
                archive.write(kernel, f"restir_engine/{cache.SHIPPED.name}/{kernel.name}")
            for wheel in wheels:
                archive.write(wheel, f"wheels/{wheel.name}", zipfile.ZIP_STORED)
        unfinished.replace(path)
    return path


def main() -> None:
    """Parse the command line and build."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--blender", nargs="+", default=["5.2"], choices=PYTHON_OF_BLENDER, help="Blender versions")
    parser.add_argument("--python", nargs="+", help="Python versions, instead of --blender")
    parser.add_argument("--platform", default="linux-x64", choices=WHEEL_TAGS)
    parser.add_argument("--out", type=Path, default=ROOT / "dist")
    options = parser.parse_args()
    if options.python:
        pythons, label = options.python, "-".join(f"python{version}" for version in options.python)
    else:
        pythons = sorted({PYTHON_OF_BLENDER[version] for version in options.blender})
        label = "-".join(f"blender{version}" for version in options.blender)
    path = build(pythons, options.platform, label, options.out)
    print(
        f"{path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path}  {path.stat().st_size >> 20} MB"
    )


if __name__ == "__main__":
    main()
