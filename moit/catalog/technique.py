"""What all techniques have in common."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from moit import _core

if TYPE_CHECKING:
    from moit.fragments import Fragments

# What the core calls each kind, at its number.
KINDS = _core.kinds()


@dataclasses.dataclass(frozen=True)
class Technique:
    """Base of all techniques.

    order_independent : whether fragments may arrive in any order.
    ties_in_order : whether that holds for distinct depths only: of fragments at one depth the
        earlier is in front.
    bits_per_pixel : state beyond a colour accumulation target; None where it grows with the
        fragments.
    published_bits : the same as papers count it, by the paper's short name.
    has_curve : whether there is a transmittance at every depth, not only at fragments.
    random : whether answers hang on a seed, and are right only on the mean over seeds.
    unit_range : the depths that moments are taken of, or None.
    local : whether a pixel's answer hangs on its own fragments and the depth range alone.
    supports_transmission : whether fragments may have coloured transmission.
    """

    order_independent: ClassVar[bool] = True
    ties_in_order: ClassVar[bool] = False
    has_curve: ClassVar[bool] = False
    random: ClassVar[bool] = False
    source: ClassVar[str] = ""
    unit_range: ClassVar[tuple[float, float] | None] = None
    kind: ClassVar[str] = ""
    in_core: ClassVar[bool] = True  # the core has its kind
    counted: ClassVar[str] = ""  # the option whose number ends the name

    @property
    def base_name(self) -> str:
        """The name without options."""
        return f"{self.kind}{getattr(self, self.counted)}" if self.counted else self.kind

    @property
    def bits_per_pixel(self) -> float | None:
        return 0

    @property
    def local(self) -> bool:
        return True

    @property
    def supports_transmission(self) -> bool:
        return _core.takes_transmission(KINDS.index(self.kind))

    @property
    def published_bits(self) -> dict[str, float]:
        return {}

    @property
    def _in_name(self) -> tuple[str, ...]:
        """Options that `base_name` shows."""
        return (self.counted,) if self.counted else ()

    def __str__(self) -> str:
        options = []
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if field.name not in self._in_name and value != field.default:
                shown = getattr(value, "__name__", "callable") if callable(value) else repr(value)
                options.append(f"{field.name}={shown}")
        return self.base_name + (f"({','.join(sorted(options))})" if options else "")

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        """Its options as the core takes them, for numbers of dtype: all that its kind has, and no
        other (the table is in csrc/python/technique.c)."""
        return {"kind": KINDS.index(self.kind)}

    def fields_for(self, f: Fragments) -> dict[str, Any]:
        """The same for a question about `f`. FragmentsError where `f` is not what it needs."""
        return self.fields_for_core(f.depth.dtype)

    def fields_for_totals(self, f: Fragments) -> dict[str, Any]:
        """The same where nothing is blended: for what pixels let through, and for bounds."""
        return self.fields_for(f)
