"""The end of completed chatter: its law against the map of one flight, and against flights of a ball on a table."""

from __future__ import annotations

import math

import numpy as np
import pytest

import vibroimpact as vi

PUSH = (1.55, 1.8)  # completed chatter at the first, none at the second


def law(restitution: float) -> vi.normal_forms.ChatterEnd:
    return vi.normal_forms.ChatterEnd("CHAT", "p", 0.0, "a stop", restitution)


@pytest.mark.parametrize("restitution", [0.05, 0.5, 0.9, 0.999])
def test_flights_that_accumulate_at_the_release_repel_others_at_the_rate_of_the_law(
    restitution: float,
) -> None:
    end = law(restitution)
    sigma = 1.0 - end.shrinking

    def speed(s: float) -> float:  # at the begin of a flight of length s, under y'' = -(1 - t)
        return s / 2.0 - s**2 / 6.0

    def after(s: float) -> float:  # at the begin of the next one, in its units
        return restitution * (s / 2.0 - s**2 / 3.0) / (1.0 - s) ** 2

    assert after(sigma) == pytest.approx(speed(sigma), rel=1e-12)
    step = 1e-5 * sigma
    slopes = [f(sigma + step) - f(sigma - step) for f in (after, speed)]
    assert end.ratio == pytest.approx(slopes[1] / slopes[0], rel=1e-8)
    assert end.shrinking == pytest.approx(end.ratio**end.power, rel=1e-12)
    assert 0.5 < end.power < 1.0


def impacts_until_the_release(push: float, restitution: float, most: int = 60) -> int:
    """Impacts of a ball, x'' = push sin t - 1, from one release until the next; ``most`` where it comes to rest."""
    begin = math.asin(1.0 / push)
    release, t, v = begin + 2.0 * math.pi, begin, 0.0
    for count in range(most):

        def place(s: float, t: float = t, v: float = v) -> float:
            return v * s - s * s / 2.0 + push * (math.sin(t) - math.sin(t + s) + s * math.cos(t))

        step = 0.2 if count == 0 else 2.0 * v / (1.0 - push * math.sin(t)) / 8.0
        low = 1.0 if count == 0 else step
        while place(low + step) > 0.0:
            low += step
            if t + low > release:
                return count
        high = low + step
        for _ in range(60):
            middle = (low + high) / 2.0
            low, high = (middle, high) if place(middle) > 0.0 else (low, middle)
        v = -restitution * (v - low + push * (math.cos(t) - math.cos(t + low)))
        t += low
        if t > release:
            return count
        if v < 1e-4 * (release - t) ** 2:
            return most
    return most


def test_balls_with_an_impact_more_are_nearer_to_the_end_of_chatter_by_the_ratio() -> None:
    low, high = PUSH
    places = []
    for count in range(4, 13):
        low, top = PUSH[0], high
        while top - low > 1e-13:
            middle = (low + top) / 2.0
            if impacts_until_the_release(middle, 0.5) > count:
                low = middle
            else:
                top = middle
        high = top
        places.append(top)
    steps = np.diff(places)
    off = np.abs(steps[1:] / steps[:-1] - law(0.5).ratio)
    assert off[-1] < 5e-4  # the next terms fall as q^k, q^2k
    assert off[0] > 1e-2
