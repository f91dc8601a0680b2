"""What bounded networks know of how far apart surfaces are, where a pixel's range is its own."""

import gpu
import numpy as np
import pytest
from test_gpu_moment_transparency import walled

import moit
from moit import BoundedNeural, FrontLayers
from moit.neural.data import drawn

TECHNIQUES = [
    BoundedNeural("power4", depth_range="pixel"),
    BoundedNeural("power6", depth_range="pixel", warp="linear"),
    FrontLayers(1, tail="neural-bounded(depth_range='pixel')"),
]


def rays(span=None):
    f = drawn("layers", 800, seed=5)
    span = f.depth_range if span is None else span
    return moit.Fragments(f.offsets, f.depth, f.alpha, f.color, depth_range=span, dtype=np.float64)


@pytest.mark.parametrize("moments", ["power4", "power6"])
def test_deviations_are_of_the_images_range_whatever_moments_are_of(moments):
    """In double moments of a pixel's own range and of the image's say the same."""
    f = rays()
    own = moit.transmittance(f, BoundedNeural(moments, depth_range="pixel", bias=0.0))
    of_image = moit.transmittance(f, BoundedNeural(moments, bias=0.0))
    assert np.quantile(np.abs(own - of_image), 0.99) < 1e-3


def test_a_wider_range_of_the_image_makes_surfaces_lie_closer():
    near, far = rays().depth_range
    wide = rays((near / 1000, far * 1000))
    for technique in ("neural-bounded", "neural-bounded(depth_range='pixel')"):
        moved = moit.transmittance(wide, technique) - moit.transmittance(rays(), technique)
        assert np.abs(moved).max() > 0.01
    # powers of depth alone know no other unit
    power = moit.PowerMoments(4, depth_range="pixel")
    assert np.array_equal(moit.transmittance(wide, power), moit.transmittance(rays(), power))


@pytest.mark.parametrize("technique", TECHNIQUES, ids=str)
def test_passes_are_given_the_same_units(technique):
    on = {"device": gpu.software_device(), "exact": True}
    for f in (walled(), walled(transmission=True)):
        for culls in (True, False):
            if technique.kind == "front" and not culls:
                with pytest.raises(moit.GpuError, match="cull_opaque: opaque fragments among"):
                    moit.composite(f, technique, **on, cull_opaque=False)
                continue
            for ask in (moit.composite, moit.transmittance):
                found = ask(f, technique, **on, cull_opaque=culls)
                expected = ask(f, technique, cull_opaque=culls)
                np.testing.assert_array_equal(found, expected)
