"""No unit of the core asks for what Linux alone has, as far as a compiler can tell."""

import pytest
from portable import SYSTEMS, complaints, missing, units


@pytest.mark.parametrize("system", SYSTEMS)
def test_the_core_compiles_for_other_systems(system):
    if needed := missing(system):
        pytest.skip(f"needs {needed}")
    assert len(units()) > 100
    assert complaints(system, units()) == ""
