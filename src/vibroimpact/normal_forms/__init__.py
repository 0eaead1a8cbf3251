"""Normal forms of maps at bifurcations of codimension one and two.

The functions take :class:`Forms`: those of the return map or half map of an orbit, of an
:class:`ExplicitMap`, or a :class:`Composition`. Coefficients are in the coordinates of the forms,
with |q| = 1, <p, q> = 1 and 0 < arg(nu) < pi.
"""

from __future__ import annotations

from vibroimpact.normal_forms.branch_point import BranchPoint
from vibroimpact.normal_forms.centre_manifold import CentreManifold, centre_manifold
from vibroimpact.normal_forms.chatter import ChatterEnd
from vibroimpact.normal_forms.codimension_one import normal_form
from vibroimpact.normal_forms.codimension_two import codimension_two
from vibroimpact.normal_forms.critical import NormalForm, Refusal, Status
from vibroimpact.normal_forms.explicit import ExplicitMap, FixedPoint, FixedPointStatus, MapForms
from vibroimpact.normal_forms.flip_fold import Flip, Fold
from vibroimpact.normal_forms.forms import Composition, Forms, Multilinear
from vibroimpact.normal_forms.neimark_sacker import NeimarkSacker
from vibroimpact.normal_forms.resonance import Resonance, nearest_resonance, resonances
from vibroimpact.normal_forms.special_points import CodimensionTwo, NewCurve
from vibroimpact.normal_forms.strong_resonance import (
    fold_directions,
    period_four,
)
from vibroimpact.normal_forms.terms import on_pair_manifold
from vibroimpact.normal_forms.touch import Added, ContactLaw, Scenario, Touch, Window

__all__ = [
    "Added",
    "BranchPoint",
    "CentreManifold",
    "ChatterEnd",
    "CodimensionTwo",
    "Composition",
    "ContactLaw",
    "ExplicitMap",
    "FixedPoint",
    "FixedPointStatus",
    "Flip",
    "Fold",
    "Forms",
    "MapForms",
    "Multilinear",
    "NeimarkSacker",
    "NewCurve",
    "NormalForm",
    "Refusal",
    "Resonance",
    "Scenario",
    "Status",
    "Touch",
    "Window",
    "centre_manifold",
    "codimension_two",
    "fold_directions",
    "nearest_resonance",
    "normal_form",
    "on_pair_manifold",
    "period_four",
    "resonances",
]
