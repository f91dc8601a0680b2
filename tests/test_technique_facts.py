"""What a technique says of itself, held to what it does."""

import dataclasses
from typing import ClassVar

import numpy as np
import pytest
from small import some_fragments
from variants import EVERY

import moit
from moit import _core
from moit.catalog.palette import technique_colours
from moit.catalog.technique import EXACT, FACTS, Technique
from moit.gpu import passes

IN_CORE = [technique for technique in EVERY if technique.engine == "core"]
every_technique = pytest.mark.parametrize("technique", EVERY, ids=str)
every_in_core = pytest.mark.parametrize("technique", IN_CORE, ids=str)

F = some_fragments(height=4, width=5, most=6, dtype=np.float64)


def pixels(layers: int, count: int = 300) -> moit.Fragments:
    """So many translucent fragments in each of some pixels, in no order."""
    rng = np.random.default_rng(layers)
    n = layers * count
    return moit.Fragments(
        np.arange(count + 1) * layers,
        rng.uniform(0.05, 0.95, n),
        rng.uniform(0.2, 0.8, n),
        rng.random((n, 3)),
        depth_range=(0.05, 0.95),
        dtype=np.float64,
    )


def error(technique: Technique, layers: int) -> float:
    f = pixels(layers)
    return float(np.abs(moit.composite(f, technique) - moit.composite(f, "sorted")).max())


@every_in_core
def test_images_are_exact_up_to_so_many_fragments_and_no_more(technique):
    most = technique.exact_up_to
    for layers in range(1, min(most, 40) + 1):
        assert error(technique, layers) < 1e-12
    if 0 < most < EXACT:
        assert error(technique, most + 1) > 1e-3


@every_technique
def test_a_curve_is_there_or_refused(technique):
    if technique.has_curve:
        assert moit.transmittance(F, technique, depth=[5.0]).shape == (4, 5, 1)
    else:
        with pytest.raises(TypeError, match="has no"):
            moit.transmittance(F, technique, depth=[5.0])


@every_in_core
def test_targets_are_summed_where_they_add_up_and_else_refused(technique):
    fields = technique.fields_for(F)
    if not technique.adds_targets:
        with pytest.raises(ValueError, match=r"sums|targets|adds"):
            _core.target_sums(F, fields, 1)
        return
    sums = _core.target_sums(F, fields, 1)
    assert sums.reshape(-1, 5)[F.counts == 0, :4].max(initial=0) == 0


@every_in_core
def test_texels_are_summed_where_they_add_up_and_else_refused(technique):
    fields = technique.fields_for(F)
    if technique.adds_texels:
        assert len(_core.texel_sums(F, fields, 1))
    else:
        with pytest.raises(ValueError, match="technique"):
            _core.texel_sums(F, fields, 1)


@every_in_core
def test_points_change_no_answer_where_they_are_taken(technique):
    """Fragments of alpha 0 behind all others of equal depth."""
    if not technique.takes_points or technique.range_per_pixel or technique.block_side > 1:
        pytest.skip("it does not take them, or a point is part of a pixel's range or of a block")
    n = len(F)
    pixel = np.repeat(np.arange(len(F.counts)), F.counts)
    order = np.argsort(np.concatenate([pixel, pixel]), kind="stable")
    given = {"shape": F.shape, "depth_range": F.depth_range}
    both = np.empty(2 * n)
    both[order] = moit.transmittance(
        moit.Fragments(
            2 * F.offsets,
            np.concatenate([F.depth, F.depth])[order],
            np.concatenate([F.alpha, np.zeros(n)])[order],
            **given,
        ),
        technique,
        cull_opaque=False,
    )
    alone = moit.transmittance(
        moit.Fragments(F.offsets, F.depth, F.alpha, **given), technique, cull_opaque=False
    )
    np.testing.assert_allclose(both[:n], alone, atol=1e-9)


@every_in_core
def test_moments_and_networks_are_there_or_refused(technique):
    fields = technique.fields_for(F)
    reading = getattr(technique, "behind", technique)  # what reads moments of the rest
    assert ("network" in fields) == reading.has_network
    for has, ask in (
        (technique.stores_moments, lambda: _core.gather(F, fields, True, 1, False)),
        (technique.has_network, lambda: _core.network_features(F, fields, True, 1)),
    ):
        if has:
            ask()
        else:
            with pytest.raises(ValueError, match="technique: expected one that"):
                ask()


def in_numbers(technique: Technique) -> Technique | None:
    """The technique in the form that rounds no sum but to the fragments' dtype; None: it has none,
    as half floats are part of it."""
    changes = technique.stored_in(False)
    if changes is None or (getattr(technique, "in_halves", False) and not changes):
        return None
    return dataclasses.replace(technique, **changes)


@every_in_core
def test_the_order_of_arrival_shows_where_it_is_said_to(technique):
    """Summed in another order, words and half floats may round otherwise; so does any sum."""
    f = pixels(40, 60)
    turned = np.arange(len(f)).reshape(60, 40)[:, ::-1].ravel()
    other = moit.Fragments(
        f.offsets, f.depth[turned], f.alpha[turned], f.color[turned], depth_range=f.depth_range
    )

    def moved_of(one: Technique) -> float:
        return float(np.abs(moit.composite(f, one) - moit.composite(other, one)).max())

    moved, numbers = moved_of(technique), in_numbers(technique)
    if technique.order_independent:
        assert moved < 0.1
        assert numbers is None or moved_of(numbers) < 1e-12
    elif technique != moit.AdaptiveTransparency(2):  # it leaves out all but the first and last
        assert moved > 1e-4


@every_in_core
def test_of_equal_depths_one_is_in_front_where_arrival_is_said_to_count(technique):
    """What a row says of arrival and what it says of ties are two of its fields."""
    if technique.order_independent:
        assert technique.ties_in_order == (technique.ties != "together")


@every_technique
def test_the_passes_over_geometry_are_as_many_as_published(technique):
    passes = technique.geometry_passes
    if isinstance(technique, moit.DepthPeeling):
        assert passes == technique.layers
    elif isinstance(technique, moit.MomentTransparency):
        assert passes == 1 + technique.passes + technique.range_per_pixel
    elif technique.engine == "core":
        assert 1 <= passes - technique.range_per_pixel <= 3
    else:
        assert passes is None


def test_a_technique_without_a_row_cannot_be_registered():
    with pytest.raises(TypeError, match="no row for 'nothing'"):

        class Nothing(Technique):
            kind: ClassVar[str] = "nothing"

    with pytest.raises(TypeError, match="no row for 'half'"):

        class Half(Technique):
            kind: ClassVar[str] = "half"
            engine: ClassVar[str] = "other"
            row: ClassVar[dict] = {"has_curve": True}


def test_each_row_is_a_technique_that_is_listed():
    assert set(FACTS) == {
        technique.kind for technique in moit.techniques() if technique.engine == "core"
    }


def test_each_row_has_passes():
    """Else tests on a GPU would skip it, and nobody would see that they are forgotten."""
    assert set(passes.kinds()) == set(FACTS)


def test_each_technique_has_a_colour_of_a_family():
    others = {technique_colours([f"unknown{place}"])[0] for place in range(12)}
    names = [str(technique) for technique in moit.techniques()]
    assert not [name for name in names if technique_colours([name])[0] in others]
