"""Common entry to all normal forms of codimension two."""

from __future__ import annotations

from collections.abc import Callable

from vibroimpact._core.checks import check_choice
from vibroimpact.normal_forms.critical import Refusal
from vibroimpact.normal_forms.degenerate import chenciner, cusp, generalised_flip
from vibroimpact.normal_forms.forms import Forms, check_forms
from vibroimpact.normal_forms.interactions import (
    double_neimark_sacker,
    flip_neimark_sacker,
    fold_flip,
    fold_neimark_sacker,
)
from vibroimpact.normal_forms.special_points import CodimensionTwo
from vibroimpact.normal_forms.strong_resonance import STRONG

ROUTES: dict[str, Callable[[Forms], CodimensionTwo | Refusal]] = {
    "CP": cusp,
    "GPD": generalised_flip,
    "CH": chenciner,
    "LPPD": fold_flip,
    "LPNS": fold_neimark_sacker,
    "PDNS": flip_neimark_sacker,
    "NSNS": double_neimark_sacker,
    **STRONG,
}


def codimension_two(kind: str, forms: Forms) -> CodimensionTwo | Refusal:
    """Compute the normal form of a map at a point of codimension two.

    Parameters
    ----------
    kind
        "CP" cusp, "GPD" generalised flip, "CH" Chenciner point, "R1" to "R4" strong resonances,
        "LPPD" fold-flip, "LPNS" fold-Neimark-Sacker, "PDNS" flip-Neimark-Sacker, "NSNS" double
        Neimark-Sacker.
    forms
        Derivatives of the map at its fixed point, at the critical parameters. The parameter's
        direction is not used. For a symmetric orbit those of the half map: periods in the result
        then count half maps.

    Returns
    -------
    CodimensionTwo or Refusal
        A :class:`Refusal` with its reason where a hypothesis fails.

    Raises
    ------
    InvalidParameterError
        An unknown kind, or what are not the forms of a map.

    Notes
    -----
    At GPD and CH only the coefficient that vanishes is computed: the next one takes fifth
    derivatives. The functions of each kind state the derivatives that they cost.

    Examples
    --------
    >>> import vibroimpact.normal_forms as nf
    >>> henon = nf.ExplicitMap(
    ...     lambda x, a: (x[1], a - x[0] - x[1] ** 2 - 0.1 * x[0] * x[1]), dimension=2
    ... )
    >>> point = nf.codimension_two("R4", henon.forms([0.0, 0.0], 0.0))
    >>> round(abs(point.scaled), 5), [str(curve) for curve in point.switchable]
    (1.199, ['SN of period 4', 'SN of period 4'])
    """
    check_forms(forms)
    check_choice("kind", kind, ROUTES)
    return ROUTES[kind](forms)
