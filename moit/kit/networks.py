"""The weights of a network in the order in which a text for engines reads them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from moit.catalog.network import Network

# Features as a network has them (the fragment's depth, count, absorbance, four moments) and what an
# output begins with: the order of the text's rows.
_FIRST = (0, 1, 2, 7, 3, 4, 5, 6)


def rows_of_moments(network: Network) -> NDArray[np.float32]:
    """(201, 4) of one with 7, 32, 16 and 1, for shaders/engine/neural.glsl.

    A row has what one input counts in four outputs that are side by side, or what these begin
    with. Eight times the eight of the first layer; four times the 32 inputs of the second, what its
    outputs begin with, and what they count in the last; what the last begins with, and three zeros.
    """
    sizes = [(32, 8), (16, 33), (1, 17)]
    ends = np.cumsum([rows * columns for rows, columns in sizes])
    parts = np.split(network.packed(), ends[:-1])
    first, second, last = (part.reshape(size) for part, size in zip(parts, sizes, strict=True))
    found = [first[at : at + 4, _FIRST].T for at in range(0, 32, 4)]
    for at in range(0, 16, 4):
        found += [second[at : at + 4].T, last[:, at : at + 4]]
    found.append(np.append(last[:, -1], [0, 0, 0])[None])
    return np.ascontiguousarray(np.concatenate(found), np.float32)
