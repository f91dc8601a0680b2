"""What the network of a technique sees of fragments: what it is trained on."""

from __future__ import annotations

import numpy as np
from numpy.typing import DTypeLike, NDArray

from moit.catalog import Technique
from moit.core.pieces import surfaces
from moit.questions import Asked, Input


def features(
    f: Input,
    technique: str | Technique,
    *,
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
    part: int | str | None = None,
    layer: str | None = None,
) -> NDArray[np.float64]:
    """(N, columns): of each fragment what the technique's network sees, before mean and scale are
    applied, as the core computes it where it runs the network, in the fragments' dtype.

    Of "neural" 7 columns: the depth between the pixel's ends, the count of fragments, b0, b1 to b4
    not divided by b0; T = sigmoid(network). Of "dfa" 5 + 2: the absorbance behind the second
    fragment, the share of it that weights leave, its transmittance, the distances from the first
    fragment to the second and from that to the last; then P and Q, for T = P + Q sigmoid(network),
    T being what the fragment's colour counts with.

    Of "neural-bounded" 8 + 2 columns: L/b0, W/b0, a, (z - mean)/deviation within +-8; ln b0 within
    +-8, ln deviation from -8 on, skewness within +-6, ln kurtosis from 0 to 6; then L and W, for
    T = exp(-(L + W sigmoid(network))). Of "neural-bounded6" 10 + 2: behind ln kurtosis come
    ln(1 + |s|) with the sign of s, the fifth standardised moment, and ln of the sixth.
    Of "strong" the same of all that is not kept, but that L has what is kept in front, too.
    Of "neural-slices" 10 + 2: L and W as shares of the total, a, how far between its slices it is,
    the share of what these two hold that is in the one in front, what the slice before them and the
    one behind hold as shares of the total; ln of the total within +-8, which share of W slices say
    by themselves, ln W from -8 to 3; then L and W.

    Arguments as `moit.transmittance`; the network itself is not run. Rows of fragments that an
    opaque surface hides, and of such surfaces, are 0; a volume has that of its first piece. Raises
    ValueError where the technique has no network, else as there.
    """
    asked = Asked.of(f, technique, threads, dtype, cull_opaque, part=part, layer=layer)
    rows = asked.in_core(blends=False).network_features()
    first = surfaces(asked.fragments, asked.technique, asked.threads)[1]
    return rows if first is None else rows[first]
