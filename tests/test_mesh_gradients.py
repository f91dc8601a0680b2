"""Derivatives through triangles: fragments are linear in colours and opacities, so sums tell."""

import numpy as np
import pytest

import moit
from moit import gradients

SIZE = (40, 30)
CAMERA = moit.Camera(eye=(0.4, 0.3, 3.0), fov_y=0.8)
RNG = np.random.default_rng(3)
UV = RNG.uniform(-1.6, 2.6, (6, 2))
POINTS = RNG.normal(size=(6, 3)) * 0.9
TRIANGLES = [[0, 1, 2], [2, 3, 4], [0, 4, 5], [1, 3, 5]]
ALPHA = (0.2, 0.5, 0.0, 0.9, 0.7, 1.0)
LIGHTS = [moit.Light((0.3, -1, -0.5), (0.9, 0.5, 0.2))]


def image(alpha=True, seed=4):
    texels = np.random.default_rng(seed).uniform(0.1, 0.9, (5, 7, 4))
    texels[..., 3] = texels[..., 3] if alpha else 1
    return texels


def patch(color=None, alpha=ALPHA, texels=None, wrap="repeat", filter="bilinear", **options):
    texture = None if texels is None else moit.Texture(texels, wrap=wrap, filter=filter)
    color = np.random.default_rng(5).uniform(size=(6, 3)) if color is None else color
    return moit.Mesh(POINTS, TRIANGLES, color, alpha, uv=UV, texture=texture, **options)


PATCHES = {
    "plain": {},
    "unlit": {"lit": False},
    "nearest": {"texels": image(), "filter": "nearest", "wrap": ("mirror", "repeat")},
    "bilinear": {"texels": image(), "wrap": ("mirror", "clamp")},
    "repeated": {"texels": image(alpha=False)},
    "clamped, unlit": {"texels": image(), "wrap": "clamp", "lit": False},
    "small images": {"texels": image(), "filter": "mipmap"},
    "cut out": {"texels": image(), "alpha_cutoff": 0.2},
}


def scene(**changed):
    """A patch between others: an opaque one that hides some of it, and glass."""
    wall = moit.Mesh([[-1, -1, -0.3], [0.2, -1, -0.3], [0.2, 1, 0.5]], [[0, 1, 2]], (0.3, 0.9, 0.1))
    glass = moit.Mesh([[-1, -1, 1], [1, -1, 1], [0, 1, 1]], [[0, 1, 2]], (0.5, 0.2, 0.7), 0.4)
    return [wall, patch(**changed), glass]


def of_scene(name, by_alpha=1.0, by_color=1.0):
    meshes = scene(**PATCHES[name])
    f, pullback = gradients.rasterize(meshes, CAMERA, SIZE, lights=LIGHTS)
    plain = moit.rasterize(meshes, CAMERA, SIZE, lights=LIGHTS, progress=False)
    assert f.color.tobytes() == plain.color.tobytes()
    rng = np.random.default_rng(6)
    d_alpha = by_alpha * rng.normal(size=f.alpha.shape)
    d_color = by_color * rng.normal(size=f.color.shape)
    return f, d_alpha, d_color, pullback(np.zeros_like(f.depth), d_alpha, d_color)


def looked_at(changed):
    """(alpha, color) of the same fragments, where the patch looks otherwise."""
    f = moit.rasterize(scene(**changed), CAMERA, SIZE, lights=LIGHTS, progress=False)
    return f.alpha.astype(float), f.color.astype(float)


@pytest.mark.parametrize("name", PATCHES)
def test_colour_moves_fragments_as_derivatives_say(name):
    f, _, d_color, by = of_scene(name)
    other = np.random.default_rng(7).uniform(size=(6, 3))
    _, color = looked_at(PATCHES[name] | {"color": other})
    assert len(color) == len(f)
    moved = other - patch().color
    told = (by.meshes[1].color * moved).sum()
    assert told == pytest.approx((d_color * (color - f.color)).sum(), abs=5e-5)
    assert abs(told) > 0.02


@pytest.mark.parametrize("name", [name for name in PATCHES if name != "cut out"])
def test_opacity_moves_fragments_as_derivatives_say(name):
    f, d_alpha, _, by = of_scene(name)
    other = np.array(ALPHA) * 0.5 + 0.25
    alpha, _ = looked_at(PATCHES[name] | {"alpha": other})
    told = (by.meshes[1].alpha * (other - np.float32(ALPHA))).sum()
    assert told == pytest.approx((d_alpha * (alpha - f.alpha)).sum(), abs=5e-5)
    assert abs(told) > 0.02


@pytest.mark.parametrize("name", [name for name, one in PATCHES.items() if "texels" in one])
def test_texels_move_fragments_as_derivatives_say(name):
    if name == "repeated":  # opaque: another alpha would be another surface
        return
    f, d_alpha, d_color, by = of_scene(name)
    texels = PATCHES[name]["texels"]
    color = image(seed=8)
    color[..., 3] = texels[..., 3]
    _, seen = looked_at(PATCHES[name] | {"texels": color})
    texture = by.meshes[1].texture
    assert texture.shape == texels.shape
    told = (texture[..., :3] * (color - texels)[..., :3]).sum()
    assert told == pytest.approx((d_color * (seen - f.color)).sum(), abs=5e-5)
    assert abs(told) > 0.02
    if name == "cut out":
        assert not texture[..., 3].any()
        return
    f, d_alpha, _, by = of_scene(name, by_color=0)
    texture, clear = by.meshes[1].texture, texels.copy()
    clear[..., 3] = image(seed=8)[..., 3]
    alpha, _ = looked_at(PATCHES[name] | {"texels": clear})
    told = (texture[..., 3] * (clear - texels)[..., 3]).sum()
    assert told == pytest.approx((d_alpha * (alpha - f.alpha)).sum(), abs=5e-5)


def test_smaller_images_have_colours_by_alpha():
    """A texel that is more there counts more in means of it and its neighbours."""
    texels = PATCHES["small images"]["texels"]
    _, _, d_color, by = of_scene("small images", by_alpha=0)
    way = np.random.default_rng(9).normal(size=texels.shape[:2])
    ends = []
    for step in (2e-3, -2e-3):
        moved = texels.copy()
        moved[..., 3] += step * way
        ends.append((d_color * looked_at(PATCHES["small images"] | {"texels": moved})[1]).sum())
    told = (by.meshes[1].texture[..., 3] * way).sum()
    assert told == pytest.approx((ends[0] - ends[1]) / 4e-3, rel=1e-3)


def test_what_is_opaque_or_cut_out_stays_so():
    by = of_scene("cut out")[3]
    assert not by.meshes[0].alpha.any()
    assert not by.meshes[1].alpha.any()
    assert by.meshes[0].color.any()
    assert by.meshes[2].alpha.all()


def test_a_picture_is_that_of_render_and_its_pullback_the_chain():
    meshes = scene(texels=image())
    image_, pullback = gradients.render(meshes, CAMERA, SIZE, "power4", background=(0.1, 0.2, 0.3))
    plain = moit.render(meshes, "power4", SIZE, camera=CAMERA, background=(0.1, 0.2, 0.3))
    assert image_.tobytes() == plain.tobytes()
    seed = np.random.default_rng(9).normal(size=image_.shape)
    by = pullback(seed)
    f, to_meshes = gradients.rasterize(meshes, CAMERA, SIZE)
    of_f = gradients.composite(f, "power4", background=(0.1, 0.2, 0.3))[1](seed)
    chained = to_meshes(of_f.depth, of_f.alpha, of_f.color)
    for one, other in zip(by.meshes, chained.meshes, strict=True):
        assert one.color.tobytes() == other.color.tobytes()
        assert one.alpha.tobytes() == other.alpha.tobytes()
    assert by.background.tobytes() == of_f.background.tobytes()


def test_what_has_no_derivatives_is_refused():
    glass = patch(transmission=0.5)
    with pytest.raises(moit.MeshError, match=r"scene\[1\].transmission: .* found 0.5"):
        gradients.rasterize([patch(), glass], CAMERA, SIZE)
    shadows = [moit.Light((0, -1, 0), (1, 1, 1), shadows="power4")]
    with pytest.raises(ValueError, match="lights: there are derivatives without shadows"):
        gradients.rasterize(patch(), CAMERA, SIZE, lights=shadows)
