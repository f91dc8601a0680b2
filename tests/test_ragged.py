"""Rays of as many samples as each has: their layouts, and what frameworks' users are told."""

import importlib
import sys

import numpy as np
import pytest

import moit
from moit.gradients import ragged

ENDS = [0, 2, 2, 5, 6, 6]
PACKED = [[0, 2], [2, 0], [2, 3], [5, 1], [6, 0]]
RAYS = [0, 0, 2, 2, 2, 3]


@pytest.mark.parametrize(
    "layout", [{"offsets": ENDS}, {"packed_info": PACKED}, {"ray_indices": RAYS, "n_rays": 5}]
)
def test_layouts_say_the_same(layout):
    assert ragged.offsets_of(6, **layout).tolist() == ENDS


def test_rays_at_the_end_are_those_that_are_named():
    assert ragged.offsets_of(6, ray_indices=RAYS).tolist() == ENDS[:-1]
    assert ragged.offsets_of(0, ray_indices=np.zeros(0, int)).tolist() == [0]
    assert ragged.offsets_of(0, ray_indices=np.zeros(0, int), n_rays=2).tolist() == [0, 0, 0]
    assert ragged.offsets_of(0, packed_info=np.zeros((0, 2), int)).tolist() == [0]


@pytest.mark.parametrize(
    ("layout", "said"),
    [
        ({}, "expected one of offsets, packed_info, ray_indices; got none"),
        ({"offsets": ENDS, "ray_indices": RAYS}, "got offsets and ray_indices"),
        ({"packed_info": [[0, 2], [3, 3]]}, r"packed_info\[1, 0\]: found 3; needed 2"),
        ({"packed_info": [0, 2]}, r"packed_info: expected shape \(R, 2\), got \(2,\)"),
        ({"ray_indices": [0, 1, 0, 2, 2, 2]}, r"ray_indices\[2\]: found 0 after 1"),
        ({"ray_indices": RAYS, "n_rays": 3}, "ray_indices: found 3; needed rays from 0 to 2"),
        ({"ray_indices": [-1, *RAYS[1:]]}, "ray_indices: found -1"),
        ({"ray_indices": RAYS[1:]}, r"ray_indices: expected shape \(6,\), got \(5,\)"),
        ({"offsets": ENDS, "n_rays": 4}, "n_rays: found 4; offsets has 5 rays"),
        ({"offsets": [0.0, 6.0]}, "offsets: expected integers, got float64"),
    ],
)
def test_what_does_not_fit_is_refused(layout, said):
    with pytest.raises((TypeError, ValueError), match=said):
        ragged.offsets_of(6, **layout)


def test_techniques_go_by_names_that_make_them_again():
    chosen = moit.PowerMoments(count=6, bias=1e-6, exclude_self=True)
    assert moit.technique(ragged.name_of(chosen)) == chosen
    with pytest.raises(ValueError, match="technique: expected one that its name describes"):
        ragged.name_of(moit.WeightedBlended(weight=lambda ray: ray.alpha))


def test_arrays_of_two_precisions_are_refused():
    alpha = np.full(2, 0.5, np.float32)
    with pytest.raises(TypeError, match="alpha: expected float64 as depth has, got float32"):
        ragged.question_of(
            ragged.Asked("transmittance", "sorted", None, None),
            np.array([0, 2]),
            [np.ones(2), alpha, *[None] * 3],
        )


@pytest.mark.parametrize("name", ["torch", "jax"])
def test_a_missing_framework_is_named_with_its_extra(name, monkeypatch):
    monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.delitem(sys.modules, f"moit.{name}", raising=False)
    with pytest.raises(ImportError, match=rf"pip install 'moit\[{name}\]'"):
        importlib.import_module(f"moit.{name}")
