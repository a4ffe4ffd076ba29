"""The text fields of Cryptomatte in several files, as one file has them."""

from __future__ import annotations

import json


def cryptomatte_fields(fields: dict[str, str]) -> dict[str, str]:
    """Those text fields of a file that tell what ids stand for."""
    return {key: text for key, text in fields.items() if key.startswith("cryptomatte/")}


def united_manifests(files: list[dict[str, str]]) -> dict[str, str]:
    """The fields of all files; a manifest has the names that any file has in it."""
    found: dict[str, str] = {}
    for fields in files:
        for key, text in cryptomatte_fields(fields).items():
            if key in found and key.endswith("/manifest"):
                names = json.loads(text) | json.loads(found[key])
                found[key] = json.dumps(names, ensure_ascii=False, separators=(",", ":"))
            else:
                found.setdefault(key, text)
    return found
