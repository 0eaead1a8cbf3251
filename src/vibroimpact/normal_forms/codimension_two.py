"""Bifurcations of maps of codimension two: their table, and the common entry to their normal forms."""

from __future__ import annotations

from functools import partial

from vibroimpact._core.checks import check_choice
from vibroimpact.normal_forms.codimension_one import NS, PD, SN
from vibroimpact.normal_forms.critical import Refusal
from vibroimpact.normal_forms.degenerate import chenciner, cusp, generalised_flip
from vibroimpact.normal_forms.forms import Forms, check_forms
from vibroimpact.normal_forms.interactions import (
    double_neimark_sacker,
    flip_neimark_sacker,
    fold_flip,
    fold_neimark_sacker,
)
from vibroimpact.normal_forms.kind import PointKind, by_label
from vibroimpact.normal_forms.special_points import CodimensionTwo
from vibroimpact.normal_forms.strong_resonance import (
    one_to_four,
    one_to_one,
    one_to_three,
    one_to_two,
)

_Two = partial(PointKind, codimension=2)
TWO = by_label((
    _Two("CP", "cusp", "cusp: two folds meet", critical=(1.0,), normal_form=cusp, of_coefficient=True),
    _Two("GPD", "generalised flip", "generalised flip: a fold of the doubled orbits begins", critical=(-1.0,),
         normal_form=generalised_flip, of_coefficient=True),
    _Two("CH", "Chenciner point", "Chenciner point: a fold of circles begins", critical=(None,),
         normal_form=chenciner, of_coefficient=True),
    _Two("R1", "strong resonance", "resonance 1:1, two multipliers 1: SN and NS touch", critical=(1.0, 1.0),
         normal_form=one_to_one, resonance=(1, 1), curves=(SN, NS)),
    _Two("R2", "strong resonance", "resonance 1:2, two multipliers -1: PD and NS touch", critical=(-1.0, -1.0),
         normal_form=one_to_two, resonance=(1, 2), curves=(PD, NS)),
    _Two("R3", "strong resonance", "resonance 1:3: a saddle orbit of period three shrinks to the point",
         critical=(None,), normal_form=one_to_three, resonance=(1, 3)),
    _Two("R4", "strong resonance", "resonance 1:4: orbits of period four compete with the circle",
         critical=(None,), normal_form=one_to_four, resonance=(1, 4)),
    _Two("LPPD", "fold-flip", "fold-flip: multipliers 1 and -1", critical=(1.0, -1.0), normal_form=fold_flip,
         curves=(SN, PD)),
    _Two("LPNS", "fold and Neimark-Sacker", "fold and Neimark-Sacker: multipliers 1 and a pair",
         critical=(1.0, None), normal_form=fold_neimark_sacker, curves=(SN, NS)),
    _Two("PDNS", "flip and Neimark-Sacker", "flip and Neimark-Sacker: multipliers -1 and a pair",
         critical=(-1.0, None), normal_form=flip_neimark_sacker, curves=(PD, NS)),
    _Two("NSNS", "two pairs", "two pairs on the unit circle", critical=(None, None),
         normal_form=double_neimark_sacker),
))  # fmt: skip


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
    check_choice("kind", kind, TWO)
    found: CodimensionTwo | Refusal = TWO[kind].normal_form(TWO[kind], forms)  # type: ignore[misc]
    return found
