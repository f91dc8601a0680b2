"""Polygons are cut into triangles that cover each of them once."""

import numpy as np
import pytest

from moit.geometry.polygons import cut

pytest.importorskip("mapbox_earcut", reason="no mapbox_earcut, so convex polygons only")

ELL = [(3, 1), (1, 1), (1, 2), (3, 2), (3, 3), (0, 3), (0, 0), (3, 0)]
ARROW = [(0, 0), (2, 1), (0, 2), (0.7, 1)]  # a concave quad
SQUARE_WITH_HOLE = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)]
TWO_HOLES = [
    *[(0, 0), (6, 0), (6, 3), (0, 3), (0, 0), (1, 1), (1, 2), (2, 2), (2, 1), (1, 1)],
    *[(4, 1), (4, 2), (5, 2), (5, 1), (4, 1), (1, 1)],
]
SPIRAL = [
    (0, 0),
    (5, 0),
    (5, 5),
    (1, 5),
    (1, 2),
    (3, 2),
    (3, 3),
    (2, 3),
    (2, 4),
    (4, 4),
    (4, 1),
    (0, 1),
]
COMB = [
    p for i in range(12) for p in ((2 * i, 0), (2 * i + 0.5, 5), (2 * i + 1, 5), (2 * i + 1.5, 0))
]
COMB = [*COMB, (24, -1), (0, -1)]
STEPS = [(0, 0), (1, 0), (2, 0), (3, 0), (3, 1), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2)]
STAR = [
    (np.cos(a) * r, np.sin(a) * r)
    for a, r in zip(np.linspace(0, 2 * np.pi, 20, endpoint=False), [3, 1] * 10, strict=True)
]
REGULAR = [(np.cos(a), np.sin(a)) for a in np.linspace(0, 2 * np.pi, 17, endpoint=False)]
SHAPES = {
    "ell": ELL,
    "arrow": ARROW,
    "hole": SQUARE_WITH_HOLE,
    "two holes": TWO_HOLES,
    "spiral": SPIRAL,
    "comb": COMB,
    "steps": STEPS,
    "star": STAR,
    "regular": REGULAR,
    "quad": [(0, 0), (1, 0), (1, 1), (0, 1)],
}
FRAMES = {
    "z": np.eye(3),
    "x": np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0.0]]),
    "aslant": np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0],
}


def area(flat):
    x, y = np.asarray(flat, float).T
    return (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2


def covering(flat, triangles, points):
    """(n,): how many triangles hold each point, and whether the polygon does (by even-odd)."""
    corners = np.asarray(flat, float)[triangles]
    sides = [
        (b - a)[:, 0] * (points[:, None] - a)[..., 1]
        - (b - a)[:, 1] * (points[:, None] - a)[..., 0]
        for a, b in ((corners[:, k], corners[:, (k + 1) % 3]) for k in range(3))
    ]
    held = np.all([side > 0 for side in sides], axis=0) | np.all([s < 0 for s in sides], axis=0)
    inside = np.zeros(len(points), bool)
    for a, b in zip(np.asarray(flat, float), np.roll(np.asarray(flat, float), -1, 0), strict=True):
        crosses = (a[1] > points[:, 1]) != (b[1] > points[:, 1])
        with np.errstate(all="ignore"):
            x = a[0] + (points[:, 1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        inside ^= crosses & (points[:, 0] < x)
    return held.sum(axis=1), inside


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("shape", SHAPES)
def test_each_point_of_a_polygon_is_in_one_triangle(shape, frame, turned):
    flat = np.array(SHAPES[shape], float)
    flat = flat[::-1] if turned else flat
    space = np.c_[flat, np.zeros(len(flat))] @ FRAMES[frame] * 0.01 + (4e5, -7, 3)
    triangles = cut(space, np.array([len(flat)]))
    corners = space[triangles]
    facets = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    np.testing.assert_allclose(
        np.linalg.norm(facets, axis=1).sum(), abs(area(flat)) * 1e-4, rtol=1e-6
    )
    # and each is turned as the polygon is
    np.testing.assert_allclose(np.linalg.norm(facets.sum(0)), abs(area(flat)) * 1e-4, rtol=1e-6)
    assert (facets.sum(0) @ np.linalg.inv(FRAMES[frame]))[2] * area(flat) > 0
    points = np.random.default_rng(0).uniform(flat.min(0), flat.max(0), (2000, 2))
    times, inside = covering(flat, triangles, points)
    np.testing.assert_array_equal(times, inside)


@pytest.mark.parametrize("start", range(8))
def test_where_an_outline_begins_does_not_matter(start):
    flat = np.roll(np.array(ELL, float), start, axis=0)
    triangles = cut(np.c_[flat, np.zeros(8)], np.array([8]))
    points = np.random.default_rng(1).uniform(0, 3, (1000, 2))
    times, inside = covering(flat, triangles, points)
    np.testing.assert_array_equal(times, inside)


def test_polygons_of_several_sizes_keep_their_order():
    shapes = [SHAPES["quad"], [(0, 0), (1, 0), (0, 1)], ELL, ARROW, [(0, 0), (1, 1)], REGULAR]
    sizes = np.array([len(shape) for shape in shapes])
    flat = np.concatenate([np.add(shape, (10.0 * i, 0.0)) for i, shape in enumerate(shapes)])
    triangles = cut(np.c_[flat, np.zeros(len(flat))], sizes)
    source = np.searchsorted(np.cumsum(sizes), triangles, side="right")
    assert (source == source[:, :1]).all()
    assert (np.diff(source[:, 0]) >= 0).all()
    assert np.bincount(source[:, 0]).tolist() == [2, 1, 6, 2, 0, 15]


@pytest.mark.parametrize(
    "flat",
    [
        [(0, 0), (1, 1), (2, 2), (3, 3)],  # a line
        [(1, 1)] * 5,
        [(0, 0), (2, 2), (2, 0), (0, 2)],  # a bow tie
        [(0, 0), (1, 0), (1, 0), (1, 1), (1, 1), (0, 1)],  # corners twice
        [(0, 0), (4, 0), (4, 4), (2, 0), (0, 4)],  # touches itself
        [(0, 0), (2, 0), (2, 2), (2, 0), (0, 0), (0, 2)],  # goes back on itself
        [(np.cos(a), np.sin(a)) for a in np.arange(5) * 4 * np.pi / 5],  # a pentagram
        [(0, 0), (1e-300, 0), (1e-300, 1e-300), (0, 1e-300)],
        [(0, 0), (1e300, 0), (1e300, 1e300), (0, 1e300)],
        [(np.nan, 0), (1, 0), (1, 1), (0, 1)],
    ],
)
def test_outlines_that_bound_nothing_or_cross_do_no_harm(flat):
    points = np.c_[np.array(flat, float), np.zeros(len(flat))]
    with np.errstate(all="ignore"):
        triangles = cut(points, np.array([len(flat)]))
    assert triangles.shape[1] == 3 and len(triangles) <= len(flat)
    assert ((triangles >= 0) & (triangles < len(flat))).all()


def test_bent_polygons_are_covered_as_seen_from_above():
    flat = np.array(STAR)
    bent = np.c_[flat, 0.1 * np.sin(3 * flat[:, 0])]
    triangles = cut(bent, np.array([len(flat)]))
    points = np.random.default_rng(2).uniform(-3, 3, (1000, 2))
    times, inside = covering(flat, triangles, points)
    np.testing.assert_array_equal(times, inside)
