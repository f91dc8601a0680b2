"""Results of a comparison in a folder, each written as soon as it is there.

For a technique on a scene `<scene>/<technique>.exr` is the image, linear and over the background,
and `<scene>/<technique>.json` has the row and the curves. The latter is written last: where it is,
both are complete. It also says what was measured, and only an equal question takes it back. Digests
of itself and of the image are in it, so that nothing damaged is taken back.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit.comparing.rows import Result, from_plain, plain
from moit.formats.images import read_image, write_image
from moit.system.files import PART, remove, write_text

if TYPE_CHECKING:
    from moit.catalog import Technique
    from moit.comparing.measurement import Job
    from moit.fragments.fragments import Fragments


class ResultsFolder:
    """The results kept in a folder."""

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = os.fspath(folder)
        os.makedirs(self.folder, exist_ok=True)

    def save(self, job: Job, fingerprint: str, result: Result) -> None:
        """Keeps one result."""
        stem = self._stem(job)
        os.makedirs(os.path.dirname(stem), exist_ok=True)
        self.forget(job)
        if result.image is not None and result.image.size:
            write_image(f"{stem}.exr", result.image, technique=job.technique)
        curves = None if result.curves is None else [numbers(one) for one in result.curves]
        asked = question(job, fingerprint)
        image = None if result.image is None else _digest_of_image(result.image)
        keep(f"{stem}.json", asked, row=plain(result.row), curves=curves, image=image)

    def find(self, job: Job, fingerprint: str) -> Result | None:
        """The result of an equal job that went well, if one is kept."""
        stem = self._stem(job)
        if not can_be_found(job.technique, job.reference):
            return None
        try:
            content = answered(f"{stem}.json", question(job, fingerprint))
            row = from_plain(content["row"])
            if row["seconds"] is None:
                return None  # it failed then; it may not now
            curves, image = content["curves"], read_image(f"{stem}.exr")
            if content["image"] != _digest_of_image(image):
                return None
            return Result(
                row,
                image,
                None if curves is None else tuple(np.array(one, np.float64) for one in curves),
            )
        except Exception:  # a damaged file may hold anything
            return None  # none, or damaged: measured again

    def forget(self, job: Job) -> None:
        """Removes what is kept for a job."""
        remove(f"{self._stem(job)}.json")

    def clear(self) -> None:
        """Removes all results kept here, and nothing else."""
        for scene in os.scandir(self.folder):
            for entry in os.scandir(scene.path) if scene.is_dir() else ():
                if is_kept(entry.path, "row"):
                    remove(entry.path)
                    remove(entry.path.removesuffix(".json") + ".exr")

    def _stem(self, job: Job) -> str:
        device = "" if job.device == "cpu" else f"-{job.device}"
        return os.path.join(self.folder, file_name(job.scene), file_name(job.label) + device)


# Answers, each a JSON file that says to what question it is.


def can_be_found(*techniques: Technique) -> bool:
    """Whether it can be told that a kept answer is theirs."""
    return all(one.identity is not None for one in techniques)


def identities(**techniques: Technique) -> dict[str, str]:
    """What a question says of techniques beside their names."""
    found = {f"{name} is": one.identity for name, one in techniques.items()}
    return {name: identity for name, identity in found.items() if identity}


def keep(path: str, question: dict[str, Any], **answer: Any) -> None:
    """Writes an answer."""
    content = {"question": question, **answer}
    content["digest"] = _digest(content)
    write_text(path, json.dumps(content, allow_nan=False) + "\n")


def answered(path: str, question: dict[str, Any]) -> dict[str, Any]:
    """The answer that was kept to an equal question; LookupError where there is none whole."""
    content = _content(path)
    digest = content.pop("digest", None)
    if content.get("question") != question or digest != _digest(content):
        raise LookupError(path)
    return content


def _digest(content: dict[str, Any]) -> str:
    text = json.dumps(content, sort_keys=True)
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def _digest_of_image(image: NDArray[Any]) -> str:
    stored = np.ascontiguousarray(image, np.float32)
    return hashlib.blake2b(stored.data, digest_size=16).hexdigest()


def is_kept(path: str, answer: str) -> bool:
    """Whether a file is an answer of that kind, and not what another process is writing to it."""
    if os.path.basename(path).startswith(PART):
        return False
    return path.endswith(".json") and {"question", answer} <= set(_content(path))


def _content(path: str) -> dict[str, Any]:
    # Also where it is nested too deeply, or too large.
    damage = (OSError, ValueError, RecursionError, MemoryError)
    with suppress(*damage), open(path, encoding="utf-8") as file:
        content = json.load(file)
        if isinstance(content, dict):
            return content
    return {}


def numbers(array: NDArray[Any]) -> list[float | None]:
    """(K,) as JSON takes it: None for what is not finite."""
    return [float(one) if np.isfinite(one) else None for one in array]


def file_name(text: str) -> str:
    """A name for a file that tells what it is of; different texts give different names."""
    safe = re.sub(r"[^A-Za-z0-9._()=,+-]+", "_", text).strip(". ")[:80]
    if safe == text and safe:
        return safe
    return f"{safe}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"


def fingerprint(f: Fragments) -> str:
    """The same for equal fragments."""
    digest = hashlib.blake2b(digest_size=16)
    digest.update(repr((f.shape, f.depth_range, f.origin, str(f.dtype))).encode())
    for array in (f.offsets, *f._arrays()[:4]):
        digest.update(b"-" if array is None else array.data)
    for name in ("back", "emission", "deviation"):
        array = getattr(f, name)
        if array is not None:
            digest.update(name.encode() + array.data)
    return digest.hexdigest()


def question(job: Job, fingerprint: str) -> dict[str, Any]:
    """What a result answers."""
    from moit.system.version import VERSION

    return {
        "moit": VERSION,
        "fragments": fingerprint,
        "technique": str(job.technique),
        "device": job.device,
        "reference": str(job.reference),
        "metrics": list(job.metrics),
        "repeat": job.repeat,
        "background": _told_background(job.background),
        **({} if job.cull_opaque else {"cull_opaque": False}),
        **({} if job.threads is None else {"threads": job.threads}),
        **identities(technique=job.technique, reference=job.reference),
    }


def _told_background(background: Any) -> list[float] | str:
    """A colour as it is, of an image a digest."""
    array = np.ascontiguousarray(background, np.float64)
    if array.ndim == 1:
        return [float(one) for one in array]
    return hashlib.blake2b(array.data, digest_size=16).hexdigest()
