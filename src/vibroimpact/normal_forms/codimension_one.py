"""Bifurcations of maps of codimension one: their table, and the common entry to their normal forms."""

from __future__ import annotations

import numpy as np

from vibroimpact._core.checks import check_choice, check_flag
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.normal_forms.branch_point import branch_point
from vibroimpact.normal_forms.critical import NormalForm, Refusal
from vibroimpact.normal_forms.flip_fold import flip, fold
from vibroimpact.normal_forms.forms import Forms, check_forms, jacobian
from vibroimpact.normal_forms.kind import PointKind, by_label
from vibroimpact.normal_forms.neimark_sacker import neimark_sacker


def _branch_point(kind: PointKind, forms: Forms, *, parameter: bool = True) -> NormalForm | Refusal:
    """Flip of a half map (multiplier -1), or branch point of any other map (multiplier +1)."""
    if _nearer_to_flip(forms):
        return flip(BREAKING, forms, parameter=parameter)
    if parameter:
        return branch_point(kind, forms)
    raise InvalidParameterError(
        "parameter = False: the branches at multiplier +1 are curves in the parameter. "
        "Give forms that take its direction."
    )


def _nearer_to_flip(forms: Forms) -> bool:
    """Whether the multiplier nearest to +1 or -1 is nearer to -1."""
    A = jacobian(forms)
    if not np.all(np.isfinite(A)):
        return True  # refused there
    nus = np.linalg.eigvals(A)
    return bool(np.min(np.abs(nus + 1.0)) < np.min(np.abs(nus - 1.0)))


SN = PointKind("SN", "fold", "fold: two orbits meet", critical=(1.0,), test="SN", normal_form=fold)
BREAKING = PointKind(
    "BP", "symmetry breaking", "symmetry breaking: two mirror images are born", critical=(-1.0,),
    normal_form=_branch_point,
)  # fmt: skip
BP = PointKind(
    "BP", "branch point", "branch point: two branches cross", critical=(1.0,), test="BP",
    normal_form=_branch_point, in_half_map=BREAKING,
)  # fmt: skip
PD = PointKind(
    "PD", "period doubling", "period doubling", critical=(-1.0,), test="flip", normal_form=flip,
    in_half_map=BREAKING,
)  # fmt: skip
NS = PointKind(
    "NS", "Neimark-Sacker", "Neimark-Sacker: a circle is born", critical=(None,), test="torus",
    normal_form=neimark_sacker,
)  # fmt: skip
ONE = by_label((SN, PD, NS, BP))


def normal_form(kind: str, forms: Forms, *, unfolded: bool = True) -> NormalForm | Refusal:
    """Compute the normal form of a map at a bifurcation of codimension one.

    Parameters
    ----------
    kind
        "NS" Neimark-Sacker, "PD" period doubling, "SN" fold, "BP" branch point: of a half map
        (multiplier -1) symmetry breaking, which is its flip; of any other map (multiplier +1) a
        transcritical point or a pitchfork.
    forms
        Derivatives of the map at its fixed point, at the critical parameter. For a symmetric orbit
        those of the half map; with P = H^2, d of P is twice d of H, conjugated where the angle of
        nu is above 90 degrees.
    unfolded
        Whether the forms take the parameter's direction. False gives the coefficient alone, without
        the side, the size and the shape of the new solutions. A branch point with multiplier +1
        needs it.

    Returns
    -------
    NeimarkSacker, Flip, Fold, BranchPoint or Refusal
        A :class:`Refusal` with its reason where a hypothesis fails: the multiplier is not critical,
        other multipliers are, a strong resonance, a coefficient that vanishes, no transversality.

    Raises
    ------
    InvalidParameterError
        An unknown kind; ``unfolded`` False at a branch point with multiplier +1.

    Notes
    -----
    The functions of each kind state the derivatives that they cost; none needs a full tensor.

    Examples
    --------
    >>> import vibroimpact.normal_forms as nf
    >>> delayed = nf.ExplicitMap(lambda x, p: (p * x[0] * (1.0 - x[1]), x[0]), dimension=2)
    >>> form = nf.normal_form("NS", delayed.forms([0.5, 0.5], 2.0))
    >>> form.supercritical, form.side, form.amplitude(1e-4).round(9)
    (True, 1, array([0.01, 0.01]))
    """
    check_forms(forms)
    check_flag("unfolded", unfolded)
    check_choice("kind", kind, ONE)
    found: NormalForm | Refusal = ONE[kind].normal_form(ONE[kind], forms, parameter=unfolded)  # type: ignore[misc]
    return found
