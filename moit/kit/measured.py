"""Errors that were measured of texts as they go home, by language: measured.json, which
docs/kits.py writes. Each holds for the very text whose digest it has."""

from __future__ import annotations

import functools
import json
from importlib.resources import files
from typing import Any

from moit.catalog import Technique
from moit.kit.including import Include


@functools.cache
def _measured() -> dict[str, dict[str, dict[str, Any]]]:
    stored = files("moit.kit").joinpath("measured.json")
    found: dict[str, dict[str, dict[str, Any]]] = json.loads(stored.read_text(encoding="utf-8"))
    return found


def measured_error(technique: Technique, include: Include) -> dict[str, Any] | None:
    """None where this text was not measured."""
    found = _measured().get(str(technique), {}).get(include.language.name)
    return found if found and found["digest"] == include.digest else None
