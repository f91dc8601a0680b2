"""Techniques whose transmittance is a Python function."""

from __future__ import annotations

import dataclasses
import numbers
import re
from collections.abc import Mapping
from typing import Any, ClassVar, NoReturn

import numpy as np

from moit.catalog.source_digest import source_digest
from moit.catalog.technique import FACTS, Technique
from moit.checks.arguments import truth

CALLABLES = ("transmittance", "curve", "total", "composite", "bounds", "gather", "read")
COUNTS = {"bits_per_pixel": numbers.Real, "geometry_passes": numbers.Integral}
FLAGS = ("order_independent", "normalize")


class PythonTechnique(Technique):
    """A technique of one's own: Python functions, usable wherever a technique is.

    name : what reports, plots and messages call it.
    transmittance : fragments -> (N,), in front of each fragment. None: it is read from what
        `gather` gives.
    bits_per_pixel : state beyond a colour accumulation target; None where it grows with the
        fragments or is not known.
    curve : (fragments, depths (K,)) -> (P, K) at these depths in each pixel; None: as `read` has
        it, and without that there is no curve.
    total : fragments -> (P,), what pixels let through; None: the product of 1 - alpha.
    composite : (fragments, background (P, 3)) -> (P, 4) or (height, width, 4), what
        `moit.composite` returns, instead of the blending below.
    bounds : (fragments, depths or None) -> (lower, upper), shapes as `transmittance` or `curve`;
        None: what the total proves.
    gather, read : two passes. gather(fragments) -> (P, ...), a state for each pixel, rounded as
        `moit.storage` does where it is stored so; read(state, depth (N,), alpha (N,)) -> (N,),
        where state has a row for each fragment, that of its pixel. At the depths of a curve alpha
        is 0.
    order_independent : whether fragments may arrive in any order; `moit.check_technique` looks.
    normalize : scale colours so that their weights sum to what the pixel covers (MBOIT equation 2).
    geometry_passes : how often it would draw transparent geometry.

    Functions get Fragments of P pixels and N fragments, `fragments.offsets` with them, in the order
    of arrival, with the image's depth_range; a whole image at once, or some of its rows where that
    has many fragments. Opaque surfaces and what they hide have been taken out, volumes are in
    pieces, emission is added by moit, and with transmission `alpha` is the net coverage. Arrays are
    copies of the function's own. Results are NumPy's, or anything with `__array__` or DLPack on the
    CPU, of real and finite numbers. Colours are blended by the transmittance as it is, in float64.

    It is also a base class, of frozen dataclasses whose fields are options: functions are methods
    then, other arguments are attributes, properties or fields, and the name, unless there is one,
    is that of the class. What looks at neighbours has `local = False`, and sees the whole image.

    It is sent to other processes by pickle, for which functions and classes stand at the top of a
    module. Results that are kept (`out` of `compare`) are of the source of these functions, and of
    the options and constants that they use: where that changes they are measured again. It has no
    passes for a device, and is computed on the CPU.

    Raises TypeError and ValueError for arguments that do not fit. What functions raise, and results
    that do not fit, raise a `moit.TechniqueError` where it is asked.

    >>> def halves(fragments):
    ...     return np.full(len(fragments), 0.5)
    >>> mine = moit.PythonTechnique("halves", halves, bits_per_pixel=0)
    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5])
    >>> moit.transmittance(f, mine).tolist()
    [0.5, 0.5]
    """

    kind: ClassVar[str] = "python"
    engine: ClassVar[str] = "python"
    row: ClassVar[Mapping[str, Any]] = {
        **dict.fromkeys(FACTS["sorted"], False),
        "kind": kind,
        "order_independent": True,
        "ties": "together",
        "takes_transmission": True,
        "thick": "points",
        "geometry_passes": 2,
    }
    source: ClassVar[str] = "one's own"
    remark: ClassVar[str] = "times are of Python"

    # What instances have of their own, or subclasses as methods, properties or fields. Of built-in
    # kinds some of it is of the class, as facts of the core's row: mypy has to look away.
    name: Any = ""
    bits_per_pixel: Any = None
    order_independent: Any = True  # type: ignore[misc]
    normalize: Any = True
    geometry_passes: Any = 2
    transmittance: Any = None
    curve: Any = None
    total: Any = None
    composite: Any = None
    bounds: Any = None
    gather: Any = None
    read: Any = None

    def __init__(
        self,
        name: str = "",
        transmittance: Any = None,
        *,
        bits_per_pixel: float | None = None,
        curve: Any = None,
        total: Any = None,
        composite: Any = None,
        bounds: Any = None,
        gather: Any = None,
        read: Any = None,
        order_independent: bool = True,
        normalize: bool = True,
        geometry_passes: int | None = 2,
    ) -> None:
        given = dict(locals())
        for key in ("name", *FLAGS, *COUNTS, *CALLABLES):
            # else what a subclass has
            if given[key] is not vars(PythonTechnique)[key]:
                object.__setattr__(self, key, given[key])
        PythonTechnique.__post_init__(self)

    def __init_subclass__(cls) -> None:
        taken = [name for name in ("kind", "engine", "row") if name in vars(cls)]
        if taken:
            raise TypeError(f"{cls.__name__}: {taken[0]} is moit's own; needed another name")
        super().__init_subclass__()
        if cls.name in ("", *(_name_of(base) for base in cls.__mro__[1:])):
            cls.name = _name_of(cls)

    def __post_init__(self) -> None:
        """Checks; also called by what `dataclasses` makes of subclasses."""
        if not isinstance(self.name, str):
            raise TypeError(f"name: expected str, got {type(self.name).__name__}")
        if not self.name.strip() or not self.name.isprintable():
            raise ValueError(f"name: expected text in one line, got {self.name!r:.80}")
        for key in CALLABLES:
            value = getattr(self, key)
            if value is not None and not callable(value):
                raise TypeError(
                    f"{key}: expected a function or None, got {type(value).__name__} ({self.name})"
                )
        if (self.gather is None) != (self.read is None):
            lacking = "gather" if self.gather is None else "read"
            raise TypeError(f"{lacking}: gather and read come together; got None ({self.name})")
        if self.transmittance is None and self.gather is None:
            raise TypeError(
                f"transmittance: expected a function, or gather and read; got None ({self.name})"
            )
        for key in FLAGS:
            truth(key, getattr(self, key))
        for key, kind in COUNTS.items():
            _check_count(key, getattr(self, key), kind)

    @property
    def has_curve(self) -> bool:  # type: ignore[override]
        """Whether there is a transmittance at every depth, not only at fragments."""
        return self.curve is not None or self.read is not None

    @property
    def base_name(self) -> str:
        return str(self.name)

    @property
    def has_name(self) -> bool:
        return False

    @property
    def identity(self) -> str | None:
        return source_digest(type(self), vars(self))

    @property
    def _in_name(self) -> tuple[str, ...]:
        return ("name", *CALLABLES)

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        raise TypeError(f"technique: {self} is Python, and has no fields for the core")

    def fields_for(self, f: Any) -> dict[str, Any]:
        return {}

    def __eq__(self, other: object) -> bool:
        return self is other or (type(self) is type(other) and vars(self) == vars(other))

    def __hash__(self) -> int:
        return hash((type(self), self.name))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({str(self)!r})"

    def __setattr__(self, name: str, value: Any) -> NoReturn:
        raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")

    def __delattr__(self, name: str) -> NoReturn:
        raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")


def _name_of(cls: type) -> str:
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", cls.__name__)
    return words.replace("_", "-").strip("-").lower()


def _check_count(name: str, value: Any, kind: Any) -> None:
    if value is None:
        return
    if isinstance(value, bool | np.bool_) or not isinstance(value, kind):
        raise TypeError(f"{name}: expected a number or None, got {value!r:.80}")
    if not 0 <= value < float("inf"):
        raise ValueError(f"{name}: expected a finite number from 0, got {value!r:.80}")
