"""Where labels stand: near their own markers, and in nobody's way."""

import numpy as np

from moit.reports.label_places import DISTANCES, place

POINT, SIZE, BOX = np.array([[50.0, 50.0]]), np.array([[10.0, 4.0]]), np.array([0.0, 0, 100, 100])


def test_a_label_stays_as_near_to_its_marker_as_it_has_to():
    turns = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    around = POINT + 9 * np.stack([np.cos(turns), np.sin(turns)], 1)  # no room beside the marker
    far, near = (
        place(POINT, SIZE, BOX, np.array([most]), around)[0]
        for most in (max(DISTANCES), min(DISTANCES))
    )
    assert near is None and far is not None
    assert np.linalg.norm(np.array(far) + SIZE[0] / 2 - POINT[0]) > 9
