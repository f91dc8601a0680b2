"""Networks of neural techniques: their weights, the files they lie in, and a plain evaluation."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import json
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit.checks.arguments import one_of, path_name
from moit.checks.exceptions import MoitError
from moit.checks.unchanging import Unchanging
from moit.formats.npz import members
from moit.system.files import writing

VERSION = 1

# What each kind of network takes and gives, and what is between: inputs, hidden layers, outputs.
SIZES: dict[str, tuple[int, ...]] = {
    "neural": (7, 32, 16, 1),
    "neural-image": (7, 32, 16, 1),
    "dfa": (5, 32, 16, 1),
    "neural-bounded": (8, 8, 8, 1),
    "neural-bounded6": (10, 8, 8, 1),
    "strong": (10, 8, 8, 1),
    "neural-slices": (10, 8, 8, 1),
}
# No technique's features are larger: positions, shares and logarithms of absorbances.
MOST_OF_FEATURES = 1e4
KINDS = tuple(SIZES)

# Larger members are not those of such networks.
MOST_BYTES = 1 << 24

# What their files hold: what there is of each layer, and the rest.
LAYERS = max(map(len, SIZES.values())) - 1
MEMBERS = (
    *(f"{part}{i}" for part in ("weights", "bias") for i in range(LAYERS)),
    *("version", "kind", "mean", "scale", "told"),
)


class NetworkError(MoitError, ValueError):
    """What a network is made of does not fit together, or a file does not hold one."""


@dataclasses.dataclass(frozen=True, eq=False)
class Network(Unchanging):
    """The weights of a small multilayer perceptron, with how they came about.

    kind : "neural", "neural-image", "dfa", "neural-bounded", "neural-bounded6", "strong" or
        "neural-slices": what it sees, and what its output means. The technique of this name runs
        it; "neural-image" is for NeuralMoments(depth_range="image"), "strong" for Strong of any
        count, "neural-slices" for NeuralSlices of any count and bits.
    weights : of each layer an array (outputs, inputs) of finite numbers, held as float32.
    biases : of each layer an array (outputs,).
    mean, scale : (inputs,) of the features it was trained on: it sees (x - mean) / scale. Scale is
        positive; None: 0 and 1. Both are held as float64.
    recipe : how it was trained: what JSON can hold.
    data_hash : of what it was trained on.
    scores : errors by name.

    Between layers negative values become 0 (ReLU); what is done to the output belongs to the
    technique. Two networks are equal where kind, weights, biases, mean and scale are; these, not
    the path of a file, make a technique's answers. Raises NetworkError, a ValueError, where shapes
    do not fit the kind or one another, or a number is not finite or so large that sums are not.

    >>> weights = [np.ones(size, np.float32) for size in [(8, 8), (8, 8), (1, 8)]]
    >>> biases = [np.zeros(size, np.float32) for size in (8, 8, 1)]
    >>> moit.Network("neural-bounded", weights, biases).kind
    'neural-bounded'
    """

    kind: str
    weights: Sequence[NDArray[np.float32]]
    biases: Sequence[NDArray[np.float32]]
    mean: NDArray[np.float64] | None = None
    scale: NDArray[np.float64] | None = None
    recipe: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    data_hash: str = ""
    scores: Mapping[str, float] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        one_of("kind", self.kind, KINDS)
        sizes = SIZES[self.kind]
        layers = len(sizes) - 1
        for name in ("weights", "biases"):
            found = getattr(self, name)
            if isinstance(found, str) or not isinstance(found, Sequence) or len(found) != layers:
                raise NetworkError(
                    f"{name}: {self.kind} needs a sequence of {layers} arrays, got "
                    f"{len(found) if isinstance(found, Sequence) else type(found).__name__}"
                )
        shapes = [(o, i) for i, o in itertools.pairwise(sizes)]
        for name, rank in (("weights", 2), ("biases", 1)):
            ready = [
                _numbers(f"{name}[{i}]", shapes[i][:rank], array, np.float32)
                for i, array in enumerate(getattr(self, name))
            ]
            object.__setattr__(self, name, tuple(ready))
        for name, default in (("mean", 0.0), ("scale", 1.0)):
            given = getattr(self, name)
            given = np.full(sizes[0], default) if given is None else given
            object.__setattr__(self, name, _numbers(name, sizes[:1], given, np.float64))
        assert self.scale is not None
        if not (self.scale > 0).all():
            at = int(np.argmin(self.scale > 0))
            raise NetworkError(f"scale[{at}]: found {self.scale[at]}; needed a positive number")
        for name in ("recipe", "scores"):
            try:
                object.__setattr__(self, name, json.loads(json.dumps(dict(getattr(self, name)))))
            except (TypeError, ValueError) as error:
                raise NetworkError(f"{name}: needed a dict that JSON can hold: {error}") from None
        if not isinstance(self.data_hash, str):
            raise NetworkError(f"data_hash: expected text, got {type(self.data_hash).__name__}")
        if not np.isfinite(self.packed()).all():
            raise NetworkError("scale: so small that weights by features are beyond float32")
        if not self._largest_sum() < 1e36:  # their products with slopes are numbers, too
            raise NetworkError(
                f"weights: so large that sums of features of {MOST_OF_FEATURES:g} leave float32"
            )

    def _largest_sum(self) -> float:
        """That any value of any layer may be, of features as large as they get."""
        reach, at, packed = np.full(self.sizes[0], MOST_OF_FEATURES), 0, self.packed()
        for inputs, outputs in itertools.pairwise(self.sizes):
            size = outputs * (inputs + 1)
            rows = np.abs(packed[at : at + size].reshape(outputs, inputs + 1).astype(np.float64))
            with np.errstate(over="ignore"):
                reach, at = rows @ np.append(reach, 1.0), at + size
        return float(reach.max())

    @property
    def sizes(self) -> tuple[int, ...]:
        """Inputs, values between layers, outputs."""
        return SIZES[self.kind]

    @functools.cached_property
    def digest(self) -> str:
        """16 digits that differ where answers may."""
        import hashlib  # late: `import moit` stays quick

        found = hashlib.sha256(self.kind.encode())
        assert self.mean is not None and self.scale is not None
        arrays: list[NDArray[Any]] = [*self.weights, *self.biases, self.mean, self.scale]
        for array in arrays:
            found.update(array.tobytes())
        return found.hexdigest()[:16]

    @functools.cached_property
    def _packed(self) -> NDArray[np.float32]:
        assert self.mean is not None and self.scale is not None
        parts = []
        for i, (weights, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            wide, shift = weights.astype(np.float64), bias.astype(np.float64)
            if i == 0:
                wide = wide / self.scale
                shift = shift - wide @ self.mean
            parts.append(np.column_stack([wide, shift]).ravel())
        with np.errstate(over="ignore"):
            packed = np.concatenate(parts).astype(np.float32)
        packed.flags.writeable = False
        return packed

    def packed(self) -> NDArray[np.float32]:
        """(numbers,) as the core and shaders take them, read-only: layer by layer, output by
        output the weights of its inputs, then its bias. The first layer has mean and scale in it,
        so that it takes features as they are."""
        return self._packed

    def forward(self, features: ArrayLike) -> NDArray[np.float64]:
        """Of features (N, inputs) what the last layer gives, (N, outputs), in float64."""
        assert self.mean is not None and self.scale is not None
        x = np.asarray(features, np.float64)
        if x.ndim != 2 or x.shape[1] != self.sizes[0]:
            raise ValueError(f"features: expected (N, {self.sizes[0]}), got {x.shape}")
        x = (x - self.mean) / self.scale
        last = len(self.weights) - 1
        for i, (weights, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            x = x @ weights.T.astype(np.float64) + bias
            x = x if i == last else np.maximum(x, 0)
        return x

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes an .npz that `read` reads, whole or not at all; no ending is added.

        In it are version, kind, weights0, bias0, weights1 .., mean, scale, and as JSON recipe,
        scores and data_hash: numpy.load and PyTorch users get at all of it.
        """
        arrays: dict[str, Any] = {"version": np.int64(VERSION), "kind": np.array(self.kind)}
        for i, (weights, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            arrays |= {f"weights{i}": weights, f"bias{i}": bias}
        told = {"recipe": self.recipe, "scores": self.scores, "data_hash": self.data_hash}
        arrays |= {"mean": self.mean, "scale": self.scale}
        arrays["told"] = np.array(json.dumps(told, sort_keys=True))
        with writing(path) as file:
            np.savez(file, **arrays)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Network:
        """The network that `write` wrote, checked; pickled objects are not read.

        Raises NetworkError for a file that holds something else, is damaged, of an unknown version
        or kind, or whose arrays do not fit; OSError for one that cannot be read.
        """
        name = path_name(path)
        with open(name, "rb") as file:
            try:
                found = members(file, MEMBERS, MOST_BYTES)
            except ValueError as error:
                raise NetworkError(f"{name!r}: not a readable network: {error}") from error
        try:
            return cls._from(found)
        except (ValueError, TypeError, RecursionError) as error:
            raise NetworkError(f"{name!r}: {error}") from None

    @classmethod
    def _from(cls, found: dict[str, NDArray[Any]]) -> Network:
        for key in ("version", "kind"):
            if key not in found:
                raise NetworkError(f"not a network: there is no {key!r} in it")
        version = found["version"]
        if version.shape != () or version.dtype.kind not in "iu" or version != VERSION:
            raise NetworkError(f"version: expected {VERSION}, got {version!r:.80}")
        kind = str(found["kind"])
        one_of("kind", kind, KINDS)
        layers = len(SIZES[kind]) - 1
        needed = [f"{part}{i}" for part in ("weights", "bias") for i in range(layers)]
        for key in (*needed, "mean", "scale", "told"):
            if key not in found:
                raise NetworkError(f"there is no {key!r} in it")
        told = json.loads(str(found["told"]))
        if not isinstance(told, dict) or not all(
            isinstance(told.get(key), dict) for key in ("recipe", "scores")
        ):
            raise NetworkError("told: needed recipe and scores")
        return cls(
            kind,
            [found[f"weights{i}"] for i in range(layers)],
            [found[f"bias{i}"] for i in range(layers)],
            found["mean"],
            found["scale"],
            told["recipe"],
            told.get("data_hash", ""),
            told["scores"],
        )

    @classmethod
    def shipped(cls, kind: str) -> Network:
        """The network of this kind that comes with moit. Raises NetworkError where none does."""
        one_of("kind", kind, KINDS)
        return _shipped(kind)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Network) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def __repr__(self) -> str:
        return f"Network({self.kind!r}, {self.digest!r})"


def network_of(given: Any, kind: str) -> Network:
    """What the option `network` of a technique stands for: None, a path or a Network, of `kind`.

    A file is read once, until it changes. Raises NetworkError and OSError that name the option.
    """
    if given is None:
        return Network.shipped(kind)
    if isinstance(given, Network):
        found = given
    else:
        name = path_name(given, "network")
        try:
            status = os.stat(name)
            found = _read_once(name, status.st_mtime_ns, status.st_size, status.st_ino)
        except OSError as error:
            raise type(error)(error.errno, f"network: {error.strerror}", name) from None
        except NetworkError as error:
            raise NetworkError(f"network: {error}") from None
    if found.kind != kind:
        raise NetworkError(f"network: expected one of kind {kind!r}, got {found.kind!r}")
    return found


@functools.lru_cache(maxsize=64)
def _read_once(name: str, modified: int, size: int, inode: int) -> Network:
    return Network.read(name)


@functools.cache
def _shipped(kind: str) -> Network:
    path = os.path.join(os.path.dirname(__file__), "weights", f"{kind}.npz")
    if not os.path.exists(path):
        raise NetworkError(f"kind: no network of kind {kind!r} comes with this moit")
    return Network.read(path)


def _numbers(name: str, shape: tuple[int, ...], given: Any, dtype: Any) -> NDArray[Any]:
    """A read-only copy in `dtype`."""
    array = np.asarray(given)
    if array.dtype.kind not in "fiu":
        raise NetworkError(f"{name}: expected real numbers, got {array.dtype}")
    if array.shape != shape:
        raise NetworkError(f"{name}: expected shape {shape}, got {array.shape}")
    with np.errstate(over="ignore"):
        ready = np.array(array, dtype, order="C")
    if not np.isfinite(ready).all():
        at = np.unravel_index(int(np.argmin(np.isfinite(ready))), shape)
        place = ", ".join(str(int(i)) for i in at)
        raise NetworkError(f"{name}[{place}]: found {array[at]}; needed a finite number")
    ready.flags.writeable = False
    return ready
