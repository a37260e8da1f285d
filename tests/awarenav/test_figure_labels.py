"""Labels beside points."""

from __future__ import annotations

from itertools import combinations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("matplotlib", reason="figures are the extra plot")

from awarenav.figures import label_points, new_figure

# Few different places, so that points coincide, or lie so close that labels would.
PLACES = st.sampled_from([0.0, 0.01, 0.03, 0.5, 1.0])


@settings(deadline=None, max_examples=20)
@given(st.lists(st.tuples(PLACES, PLACES), max_size=12))
def test_no_label_lies_over_another_one(places: list[tuple[float, float]]) -> None:
    axes = new_figure(6.0, 4.0).subplots()
    axes.set(xlim=(-0.2, 1.2), ylim=(-0.2, 1.2))
    label_points(axes, [(x, y, f"{n} label", "black") for n, (x, y) in enumerate(places)])
    boxes = [text.get_window_extent() for text in axes.texts]
    assert [text.get_text() for text in axes.texts] == [f"{n} label" for n in range(len(places))]
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
