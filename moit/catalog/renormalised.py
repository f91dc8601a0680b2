"""What techniques share whose papers leave colours as they come out."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from moit.catalog.options import flag
from moit.catalog.technique import Technique


class Renormalised(Technique):
    """Those that `normalize` changes, which is False as published; the option is theirs.

    Of others that have it True is the default.
    """

    normalize: bool

    # of a class elsewhere, here of the options: who asks has an instance, and reads either alike
    @property
    def remark(self) -> str:  # type: ignore[override]
        return "" if self.normalize else "as published, not renormalised"

    @property
    def renormalised(self) -> Technique | None:
        if self.normalize:
            return None
        changes: dict[str, Any] = {"normalize": True}
        return dataclasses.replace(self, **changes)

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {**super().fields_for_core(dtype), "normalize": self.normalize}

    def _check_normalize(self) -> None:
        flag(self, "normalize")
