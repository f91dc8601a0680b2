"""The harness of vkQuake sees what it is for."""

import numpy as np
import pytest

import moit
from moit.experiments import vkquake


def test_a_lone_surface_is_seen_alike_at_every_depth():
    assert vkquake.lone_surfaces("sorted") == {"lone_spread": 0, "lone_off": 0}
    assert vkquake.lone_surfaces("power4")["lone_off"] == 0
    assert vkquake.lone_surfaces("fourier7")["lone_off"] > 100


def test_two_layers_are_right_where_moments_determine_them_and_blurred_in_words():
    exact = vkquake.two_layers("sorted")
    assert exact == {"pair_max": 0, "pair_close": 0}
    # of red alone, blended over green: unsorted has the wrong one in front
    assert vkquake.two_layers("unsorted")["pair_max"] == pytest.approx(0.25)
    sharp, blurred = (vkquake.two_layers(one)["pair_close"] for one in ("power4", "power4-16"))
    assert sharp < 1e-4 < blurred < vkquake.PAIR_OFF


def test_sixteen_coincident_layers_are_as_bright_as_they_cover():
    assert vkquake.coincident_layers("weighted-sum")["coincident"] == pytest.approx(
        16 * 0.1 - (1 - 0.9**16), abs=1e-5
    )
    assert vkquake.coincident_layers("power8")["coincident"] < 1e-5


def test_its_depths_are_octaves():
    f = vkquake._layers(np.array([[0.0, 0.5], [1.0, 1.0]]), 0.5, np.eye(3)[:2])
    assert f.depth.tolist() == [1, 2**7, 2**14, 2**14]


def test_it_asks_every_technique():
    asked = {row["technique"] for row in moit.experiment("vkquake", "tiny", progress=False).rows}
    assert asked >= {str(one) for one in moit.techniques()}
