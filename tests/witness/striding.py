"""The first root of a function, proved to be the first.

With g > 0 at t and |g''| <= M from t on, g cannot vanish before the positive root of

    g + g' s - M s^2 / 2 = 0,   s = (g' + sqrt(g'^2 + 2 M g)) / M                     (1)

so the search strides by s. Strides converge to a simple root quadratically and from below,
pass a near miss geometrically, and never step over a root. A start where g and its first
derivatives vanish, G = g^(m) > 0 being the first that does not, is free of roots on

    0 < t <= G / (2 B),   |g^(m+1)| <= B                                              (2)
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from .precision import Real, mp

if TYPE_CHECKING:
    from collections.abc import Callable

    Sample = tuple[Real, Real, Real]  # g, g', M at a time


def stride(g: Real, slope: Real, bound: Real) -> Real:
    """The length (1) of a stride that steps over no root, written without cancellation."""
    root = mp.sqrt(slope * slope + 2 * bound * g)
    return (slope + root) / bound if slope > 0 else 2 * g / (root - slope)


def first_root(
    samples: Callable[[Real], list[Sample]], t: Real, t_max: Real, noise: Real
) -> tuple[Real, int] | None:
    """Find the first root of several functions after `t`; all must be positive at `t`.

    Parameters
    ----------
    samples
        From a time to (g, g', M) of each function.
    noise
        What rounding may add to g: a function below it counts as zero.

    Returns
    -------
    The time and which function, or None where no root lies before `t_max`.
    """
    while t < t_max:
        values = samples(t)
        strides = []
        for i, (g, slope, bound) in enumerate(values):
            if g <= noise:
                return (t - g / slope if slope else t), i
            strides.append(stride(g, slope, bound))
        t += min(strides)
    return None
