"""What the core is told of a technique: every option of its kind by its name, and nothing else."""

import numpy as np
import pytest
from small import some_fragments
from variants import EVERY

import moit
from moit import _core

F = some_fragments(height=4, width=5, most=4)
IN_CORE = [technique for technique in EVERY if technique.engine == "core"]
every_technique = pytest.mark.parametrize("technique", IN_CORE, ids=str)


def ask(fields):
    return _core.composite(F, fields, True, 1, np.zeros(3))[0]


@every_technique
def test_each_option_is_needed_by_its_name(technique):
    fields = technique.fields_for(F)
    ask(fields)
    for name in fields:
        with pytest.raises(TypeError, match=rf"'{name}'") as caught:
            ask({other: value for other, value in fields.items() if other != name})
        assert name == "kind" or technique.kind in str(caught.value)


@every_technique
def test_an_option_that_the_kind_has_not_is_refused(technique):
    fields = technique.fields_for(F)
    others = {name for one in IN_CORE for name in one.fields_for(F)} - set(fields)
    for name in ["max_alfa", *others]:
        with pytest.raises(TypeError, match=f"{technique.kind} has no option '{name}'"):
            ask({**fields, name: 0})


@pytest.mark.parametrize(
    ("technique", "name", "wrong"),
    [
        ("power4", "bits", 64),
        ("power4", "warp", 3),
        ("power4", "count", 5),
        ("trig3", "wrapping_zone", 2.0),
        ("moment-transparency", "passes", 3),
        ("moment-transparency", "storage", -1),
        ("wboit", "weight", 7),
        ("stochastic8", "seed", -1),
    ],
)
def test_a_value_outside_its_range_is_refused(technique, name, wrong):
    with pytest.raises(ValueError, match=r"expected|has no loop"):
        ask({**moit.technique(technique).fields_for(F), name: wrong})


def test_kinds_are_numbers():
    with pytest.raises(ValueError, match="kind: expected 0 to"):
        ask({"kind": 99})
