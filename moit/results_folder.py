"""Results of a comparison in a folder, each written as soon as it is there.

For a technique on a scene `<scene>/<technique>.npz` has the image (H, W, 4) and the curves, and
`<scene>/<technique>.json` the row. The latter is written last, so where it is the cell is
complete; it also says what was measured, and only an equal question takes it back.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import zipfile
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from moit.files import replacing
from moit.report import Result, from_plain, plain, write_text

if TYPE_CHECKING:
    from moit.fragments import Fragments
    from moit.measurement import Job


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
        arrays = {} if result.image is None else {"image": result.image}
        arrays |= {f"curve{i}": curve for i, curve in enumerate(result.curves or ())}
        with replacing(f"{stem}.npz") as part, open(part, "xb") as file:
            np.savez_compressed(file, **arrays)
        content = {"question": question(job, fingerprint), "row": plain(result.row)}
        write_text(f"{stem}.json", json.dumps(content, indent=1, allow_nan=False) + "\n")

    def find(self, job: Job, fingerprint: str) -> Result | None:
        """The result of an equal job that went well, if one is kept."""
        stem = self._stem(job)
        try:
            with open(f"{stem}.json", encoding="utf-8") as file:
                content = json.load(file)
            if content["question"] != question(job, fingerprint):
                return None
            row = from_plain(content["row"])
            with np.load(f"{stem}.npz", allow_pickle=False) as arrays:
                if "image" not in arrays:
                    return None  # it failed then; it may not now
                names = [f"curve{i}" for i in range(len(job.pixels))]
                curves = tuple(arrays[name] for name in names) if names[0] in arrays else None
                return Result(row, arrays["image"], curves)
        except (OSError, ValueError, KeyError, IndexError, TypeError, zipfile.BadZipFile):
            return None  # none, or not one of ours: measured again

    def forget(self, job: Job) -> None:
        """Removes what is kept for a job."""
        with suppress(FileNotFoundError):
            os.unlink(f"{self._stem(job)}.json")

    def _stem(self, job: Job) -> str:
        device = "" if job.device == "cpu" else f"-{job.device}"
        return os.path.join(self.folder, file_name(job.scene), file_name(job.label) + device)


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
    for array in (f.offsets, f.depth, f.alpha, f.color, f.transmission):
        digest.update(b"-" if array is None else memoryview(array).cast("B"))
    return digest.hexdigest()


def question(job: Job, fingerprint: str) -> dict[str, Any]:
    """What a result answers."""
    from moit import __version__

    return {
        "moit": __version__,
        "fragments": fingerprint,
        "technique": str(job.technique),
        "device": job.device,
        "reference": str(job.reference),
        "metrics": list(job.metrics),
        "repeat": job.repeat,
    }
