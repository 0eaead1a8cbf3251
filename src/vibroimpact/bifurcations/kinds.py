"""Kinds of special points of curves of bifurcations, of codimension two: the table to which a new kind is added.

Smooth ones are those of maps (normal_forms/codimension_two.py), to which this adds from which orbits the curves start
that begin there. Touches are those of branches, met on a curve.
"""

from __future__ import annotations

from dataclasses import replace

from vibroimpact.bifurcations.grazing_contact import critical_contact, grazing_contact
from vibroimpact.bifurcations.starting_orbits import doubled_orbit, folds_of_four, saddles_of_three
from vibroimpact.branches.kinds import GR, NS, PD, SIM, SN, STICKING, ZERO
from vibroimpact.normal_forms.codimension_two import TWO as OF_MAPS
from vibroimpact.normal_forms.kind import PointKind, by_label

BEGINS = {
    "R2": doubled_orbit, "R3": saddles_of_three, "R4": folds_of_four, "GPD": doubled_orbit, "LPPD": doubled_orbit,
    "PDNS": doubled_orbit,
}  # fmt: skip
CROSSING = PointKind("BP", "curves cross", "two curves of this kind cross", codimension=2)
WEAK = PointKind(
    "WEAK", "weak resonance", "weak resonance: a tongue of locked orbits begins", codimension=2
)
RESONANT = PointKind(
    "RES", "resonant touch", "resonant touch: an impact does not move the gap a turn later", codimension=2, touch=True,
)  # fmt: skip
CHANGE = PointKind(
    "SIDE", "change of side", "change of side: the orbit with the impact begins on the other side of the touch",
    codimension=2, touch=True,
)  # fmt: skip
TWO = by_label((
    *(replace(kind, begins=BEGINS.get(kind.label)) for kind in OF_MAPS.values()),
    CROSSING,
    WEAK,
    *(replace(kind, codimension=2, begins=None, normal_form=grazing_contact) for kind in (GR, ZERO)),
    *(replace(kind, codimension=2) for kind in (SIM, STICKING)),
    RESONANT,
    CHANGE,
))  # fmt: skip
AT_TOUCH = by_label(
    replace(kind, codimension=2, critical=(), touch=True, begins=None, normal_form=critical_contact)
    for kind in (SN, PD, NS)
)
"""Kinds of one parameter that are points of curves of touches: a multiplier of the touching orbit is critical."""


def with_multipliers(*critical: float | None) -> PointKind:
    """The kind with these critical multipliers; of a single one, or pair, that where a coefficient vanishes."""
    return next(
        kind
        for kind in TWO.values()
        if sorted(map(str, kind.critical)) == sorted(map(str, critical))
        and (len(critical) > 1 or kind.resonance is None)
    )
