"""The documents: lines that fit, links that lead somewhere, commands and settings that exist."""

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
LONGEST = 120


def name_of(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_lines_fit(page):
    long = [number for number, line in enumerate(page.read_text().splitlines(), 1) if len(line) > LONGEST]
    assert not long, f"lines of more than {LONGEST} characters: {long}"


def anchors(page: Path) -> set[str]:
    """What a link into the page may name: its headings as GitHub writes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
        if "://" in target:
            continue
        path, _, anchor = target.partition("#")
        place = page if not path else page.parent / path
        assert place.exists(), target
        assert not anchor or place.suffix != ".md" or anchor in anchors(place), target


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_commands_name_modules_that_exist(page):
    for module in re.findall(r"python -m ([\w.]+)", page.read_text()):
        assert importlib.util.find_spec(module), module


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_files_that_are_named_exist(page):
    """Paths from the repository's root, and those of kernels from the package's."""
    for path in re.findall(
        r"`((?:kernels|integrators|scene|sync|tests|testing|benchmarks|docs|demo)/[\w/.]*)`", page.read_text()
    ):
        places = [ROOT / path, ROOT / "restir_engine" / path]
        places += [place.with_suffix(".py") for place in places]
        assert any(place.exists() for place in places), path
