"""What is drawn can be copied and sent to other processes, and does not change there either."""

import copy
import pickle

import numpy as np
import pytest
from small import out_of_a_message

import moit

RNG = np.random.default_rng(3)
CORNERS = RNG.uniform(-1, 1, (12, 3)).astype(np.float32)
TURNS = RNG.normal(size=(6, 4))
DRAWN = {
    "mesh": lambda: moit.Mesh(
        CORNERS,
        np.arange(12).reshape(4, 3),
        color=RNG.random((12, 3)),
        uv=RNG.random((12, 2)),
        texture=moit.Texture(RNG.integers(0, 255, (4, 4, 4), np.uint8), color_space="srgb"),
    ),
    "points": lambda: moit.Points(CORNERS, radius=0.1, color=RNG.random((12, 3)), alpha=0.5),
    "lines": lambda: moit.Lines(CORNERS, [0, 5, 12], pixels=3.0, alpha=0.5),
    "splats": lambda: moit.Splats(
        CORNERS[:6], RNG.uniform(0.1, 0.3, (6, 3)), TURNS, RNG.random(6), antialiased=True
    ),
    "volume": lambda: moit.Volume(
        RNG.random((3, 4, 5)), spacing=0.3, origin=(-0.5, -0.5, -0.5), step=0.2
    ),
}


WAYS = {
    "pickle": lambda thing: pickle.loads(pickle.dumps(thing)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "message": lambda thing: out_of_a_message(thing, is_written_over=True),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", DRAWN)
def test_what_is_drawn_is_the_same_when_copied(name, way):
    thing = DRAWN[name]()
    found = WAYS[way](thing)
    assert type(found) is type(thing) and repr(found) == repr(thing)
    f, g = (moit.rasterize(one, moit.Camera(), (32, 24)) for one in (thing, found))
    assert len(f) > 20
    for array in ("offsets", "depth", "alpha", "color"):
        np.testing.assert_array_equal(getattr(g, array), getattr(f, array))
    with pytest.raises(AttributeError, match="not change"):
        found.alpha = 1
    slots = [one for cls in type(found).__mro__ for one in getattr(cls, "__slots__", ())]
    held = [getattr(found, one) for one in slots]
    arrays = [one for one in held if isinstance(one, np.ndarray)]
    assert arrays and not any(one.flags.writeable for one in arrays)
