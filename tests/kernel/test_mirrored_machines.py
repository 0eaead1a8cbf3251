"""Random machines of every element, mirrored and numbered otherwise: the same events."""

from __future__ import annotations

import numpy as np
import pytest
from support.mirrored_machines import (
    difference,
    events,
    mirrored,
    random_case,
    renumbered,
    seen_in_order,
    seen_mirrored,
)

LASTS, IMPACTS = 8.0, 40  # rounding has not grown to the tolerance by then
TOLERANCE = 1e-9


def differences(seeds: range) -> dict[int, str]:
    """Seeds of machines that are not seen alike, with what differs first."""
    found: dict[int, str] = {}
    for seed in seeds:
        case = random_case(seed)
        own, end = events(case, LASTS, IMPACTS)
        image, end_of_image = events(mirrored(case), LASTS, IMPACTS)
        other, order, places = renumbered(case, np.random.default_rng(seed))
        turned, end_of_turned = events(other, LASTS, IMPACTS)
        ends = {end, end_of_image, end_of_turned}
        for seen in (
            [seen_mirrored(e) for e in image],
            [seen_in_order(e, order, places) for e in turned],
        ):
            if what := difference(seen, own, TOLERANCE):
                found[seed] = what
        if len(ends) > 1 or "UNDECIDED" in ends:
            found[seed] = ", ".join(sorted(ends))
    return found


@pytest.mark.parametrize("first", range(0, 80, 20))
@pytest.mark.one_in(3)
def test_machines_seen_from_the_other_side_or_renumbered_have_the_same_events(first: int) -> None:
    assert differences(range(first, first + 20)) == {}


@pytest.mark.slow
@pytest.mark.parametrize(("first", "last"), [(80, 200), (960, 970)])
def test_many_machines_seen_otherwise_have_the_same_events(first: int, last: int) -> None:
    assert differences(range(first, last)) == {}
