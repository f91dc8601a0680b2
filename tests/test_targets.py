"""What techniques say that they draw to, held to what passes over triangles bind."""

import numpy as np
import pytest
from gpu import device
from variants import EVERY

import moit
from moit.gpu.meshes import Drawing
from moit.per_pixel.plan import CANDIDATES

BLENDS = {"add", "max", "multiply-complement", "over", "ordered"}


@pytest.mark.parametrize("technique", EVERY, ids=str)
def test_the_facts_are_there_for_all(technique):
    assert technique.bits_per_pixel is None or technique.bits_per_pixel >= 0
    assert technique.geometry_passes is None or technique.geometry_passes >= 1
    assert type(technique.needs_order) is bool and type(technique.sorts) is bool
    assert type(technique.order_independent) is bool and technique.exact_up_to >= 0
    assert {target.blend for target in technique.targets} <= BLENDS
    if technique.bits_per_pixel is None:
        assert technique.sorts and not technique.targets


def test_what_does_not_depend_on_order_needs_none_but_to_round():
    for one in EVERY:
        if one.needs_order and one.order_independent:
            assert one.bits == 16 or isinstance(one, moit.PerPixel)


def test_a_technique_for_each_pixel_needs_what_its_candidates_need():
    assert any(moit.technique(one).needs_order for one in CANDIDATES)
    assert moit.PerPixel(techniques=("mlab2", "power4")).needs_order
    assert not moit.PerPixel(techniques=("power4", "trig2")).needs_order


# Every family that is drawn, and each of its forms.
DRAWN = (
    *("unsorted", "weighted-sum", "weighted-average", "wboit", "wboit(bits=16)"),
    *("moment-transparency", "moment-transparency-lr8", "two-moments-pass"),
    *("power4", "power8", "power6-16", "power4-16(b0='float32')", "trig2", "trig3-16"),
    *("fourier7", "fourier15(bits=32)", "adaptive4", "adaptive2(quantized=False)", "mlab2"),
    *("neural", "neural(depth_range='image')", "neural-bounded6", "neural-slices4"),
    *("anchors2", "slices8(cells=64,resolution=2)"),
)


@pytest.mark.parametrize("name", DRAWN)
def test_passes_bind_the_targets_that_are_told(name, monkeypatch):
    one, gpu = moit.technique(name), device()
    ordered = "fetch" if "GL_EXT_shader_framebuffer_fetch" in gpu.info["extensions"] else None
    bound = []
    draw = Drawing.draw

    def noted(self, parts, *arguments, **options):
        targets = options.get("targets") or []
        blends = options.get("blend") or ["ordered"] * len(targets)
        if parts is self.transparent:
            bound.append([(t.format, b) for t, b in zip(targets, blends, strict=True)])
        return draw(self, parts, *arguments, **options)

    monkeypatch.setattr(Drawing, "draw", noted)
    triangle = np.array([[-1, -1, -3], [1, -1, -3], [0, 1, -3]], float)
    mesh = moit.Mesh(triangle, np.array([[0, 1, 2]]), (1, 0.5, 0.25), 0.5)
    camera = moit.Camera((0, 0, 0), (0, 0, -1), (0, 1, 0), 1.0, 1.0, 10.0)
    how = {"ordered": ordered} if one.needs_order else {}
    picture = moit.render(
        [mesh], one, (16, 16), camera=camera, device=gpu, exact=True, report=True, **how
    )
    if one.needs_order and picture.way != "fetch":
        pytest.skip("this device draws to no ordered targets")
    told = [(target.format, target.blend) for target in one.targets]
    passes = [one for i, one in enumerate(bound) if one and one not in bound[:i]]  # each once
    assert [target for targets in passes for target in targets] == told
