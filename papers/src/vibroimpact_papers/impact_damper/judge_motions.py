"""Rules for claims about attractors: types, absent types, trends, routes.

Attractors coexist, and the paper seldom states a start: a type agrees if one of the attractors
found at that frequency has it. Types are tests of the classification:

    fixed_point           periodic with n = 1 (and the printed p, q)
    unstable_fixed_point  the closed-form orbit of the branch is a motion, and unstable
    periodic              periodic with the printed n, p, q
    phase_locked          periodic with n >= 2
    quasiperiodic         on closed curves, of the printed number where one is printed
    torus_doubled         on two closed curves, or on one that winds twice
    break_of_circle       on no closed curve any more: chaotic, or periodic with n >= 2
    chaotic               largest Lyapunov exponent above three errors, and stretching
    unstable_torus        not decided by simulation forwards; differs if the torus found attracts
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from vibroimpact.attractors.classify import Attractor
from vibroimpact.attractors.point_sets import Kind
from vibroimpact_papers.impact_damper.evidence import Evidence
from vibroimpact_papers.impact_damper.measures import extent, harmonics, width
from vibroimpact_papers.impact_damper.panel_results import LabelledAttractor, PanelResult, labels
from vibroimpact_papers.judged import Claim, RuleResult, listed, number, rule_result

WITNESS = "classification"


def attractor_type(claim: Claim, evidence: Evidence) -> RuleResult:
    """Search for an attractor of the printed type at every panel of the claim."""
    panels = _panels(claim, evidence)
    kind = claim.printed["type"]
    if not panels:
        return rule_result(None, "no panel computed", "the claim names no panel")
    if kind == "unstable_fixed_point":
        return _unstable_orbit(panels, evidence)
    if kind == "unstable_torus":
        return _unstable_torus(panels)
    answers = [_any_matches(claim, panel) for panel in panels]
    holds = None if None in answers and False not in answers else all(answers)
    return rule_result(holds, _attractors(panels), _numbers_of(panels), **_json(panels))


def no_attractor(claim: Claim, evidence: Evidence) -> RuleResult:
    """Search for an attractor of a type that is stated to be absent."""
    panels = _panels(claim, evidence)
    if not panels:
        return rule_result(None, "no panel computed", WITNESS)
    answers = [_any_matches(claim, panel) for panel in panels]
    holds = False if True in answers else None if None in answers else True
    return rule_result(holds, _attractors(panels), _numbers_of(panels), **_json(panels))


def impacts(claim: Claim, evidence: Evidence) -> RuleResult:
    """Check whether the motion stays on a closed curve for the printed number of impacts."""
    panels = _panels(claim, evidence)
    wanted = int(number(claim, "impacts"))
    curves = [f for p in panels for f in p.found if _is(f, Kind.QUASIPERIODIC)]
    counts = [len(f.points) for f in curves]
    return rule_result(
        max(counts, default=0) >= wanted if panels else None,
        listed(f"{n} points on the curve ({f.start})" for n, f in zip(counts, curves, strict=True)),
        "points of the section that were tested to lie on one closed curve",
        points=counts,
    )


def trend(claim: Claim, evidence: Evidence) -> RuleResult:
    """Measure a quantity at each panel and compare its direction."""
    panels = sorted(_panels(claim, evidence), key=lambda p: -p.omega)
    kind, measure, name = _QUANTITIES[str(claim.printed["quantity"])]
    values = [(p.omega, v) for p in panels if (v := _measured(p, kind, measure)) is not None]
    shown = listed((f"{v:.4g} at {omega}" for omega, v in values), f"no panel is {kind}")
    rule = f"{name} of what is {kind}; {_numbers_of(panels)}"
    if len(values) < 2:
        return rule_result(None, shown, f"fewer than two panels to compare; {rule}")
    steps = np.diff([v for _, v in values])
    rising = bool(np.all(steps > 0)), bool(np.all(steps < 0))
    grows_downwards = (
        claim.printed["over"] == "omega" and claim.printed["direction"] == "decreasing"
    )
    along_panels = claim.printed["over"] == "panels" and claim.printed["direction"] == "increasing"
    holds = rising[0] if grows_downwards or along_panels else rising[1]
    return rule_result(holds, shown, rule, values=values)


def instability(claim: Claim, evidence: Evidence) -> RuleResult:
    """Compare the frequencies of the circles and of chaos."""
    panels = [evidence.panels[name] for name in evidence.panels if _of_set(name, claim, evidence)]
    where = {
        kind: [p.omega for p in panels if any(_is(f, kind) for f in p.found)]
        for kind in (Kind.QUASIPERIODIC, Kind.CHAOTIC)
    }
    circles, chaos = where[Kind.QUASIPERIODIC], where[Kind.CHAOTIC]
    shown = f"circles at ω = {circles or 'no panel'}; chaos at {chaos or 'no panel'}"
    if not circles or not chaos:
        return rule_result(None, shown, WITNESS)
    if min(chaos) > max(circles):
        found = "increasing"
    elif max(chaos) < min(circles):
        found = "decreasing"
    else:
        found = "neither"
    return rule_result(found == claim.printed["direction"], f"{found} ω: {shown}", WITNESS)


def route(claim: Claim, evidence: Evidence) -> RuleResult:
    """Search for the printed types in their order as omega decreases."""
    names = claim.panels or [n for n in evidence.panels if _of_set(n, claim, evidence)]
    panels = sorted((evidence.panels[n] for n in names if n in evidence.panels),
                    key=lambda p: -p.omega)  # fmt: skip
    sequence = claim.printed["sequence"]
    assert isinstance(sequence, list)
    if not panels:
        return rule_result(None, "no panel computed", WITNESS)
    place, missing = 0, ""
    for wanted in map(str, sequence):
        tests = (i for i in range(place, len(panels)) if _panel_has(wanted, panels[i]))
        found = next(tests, None)
        if found is None:
            missing = wanted
            break
        place = found + 1
    computed = _attractors(panels)
    lacking = f"no {missing.replace('_', ' ')} in its place"
    rule = f"{WITNESS}; {lacking if missing else 'all found in order'}"
    return rule_result(not missing, computed, rule, missing=missing)


# --- types --------------------------------------------------------------------------------------


def matches(kind: str, printed: Mapping[str, object], a: Attractor) -> bool:
    """Return whether an attractor is of a type of the vocabulary above."""
    if kind in ("fixed_point", "periodic"):
        if a.type is None or (kind == "fixed_point" and a.type.n_periods != 1):
            return False
        return all(printed.get(k, v) == v for k, v in zip("npq", a.type, strict=True))
    if kind == "phase_locked":
        return a.type is not None and a.type.n_periods >= 2
    if kind == "quasiperiodic":
        return (
            a.kind is Kind.QUASIPERIODIC and printed.get("curves", a.shape.pieces) == a.shape.pieces
        )
    if kind == "torus_doubled":
        turns = a.shape.curve.turns if a.shape.curve else 0
        return a.kind is Kind.QUASIPERIODIC and 2 in (a.shape.pieces, turns)
    if kind == "break_of_circle":
        return a.kind is Kind.CHAOTIC or matches("phase_locked", {}, a)
    return kind == "chaotic" and a.kind is Kind.CHAOTIC


def _any_matches(claim: Claim, panel: PanelResult) -> bool | None:
    printed = dict(claim.printed)
    found = _from_start(claim, panel)
    if any(matches(str(printed["type"]), printed, f.attractor) for f in found):
        return True
    undecided = any(f.attractor.kind is Kind.UNDECIDED for f in found)
    return None if undecided or not found else False


def _panel_has(kind: str, panel: PanelResult) -> bool:
    return any(matches(kind, {}, f.attractor) for f in panel.found)


def _from_start(claim: Claim, panel: PanelResult) -> Sequence[LabelledAttractor]:
    """Keep the start that the paper states, at the frequency for which it states it."""
    if claim.start == "theoretical fixed point" and panel.omega == claim.omega:
        return [f for f in panel.found if f.start == "fixed point"]
    return panel.found


def _unstable_orbit(panels: list[PanelResult], evidence: Evidence) -> RuleResult:
    orbits = [evidence.branch(p.panel.set, p.omega) for p in panels]
    sizes = [float(max(abs(o.multipliers))) for o in orbits if o is not None]
    holds = len(sizes) == len(orbits) and min(sizes) > 1.0
    return rule_result(
        holds,
        listed((f"largest |λ| {s:.6f}" for s in sizes), "no orbit"),
        f"multipliers of the closed-form orbit, determinant identity within "
        f"{max((abs(o.determinant_error) for o in orbits if o), default=0.0):.0e}; simulation: "
        f"{_attractors(panels)}",
        moduli=sizes,
    )


def _unstable_torus(panels: list[PanelResult]) -> RuleResult:
    attracts = any(_is(f, Kind.QUASIPERIODIC) for p in panels for f in p.found)
    reason = "the torus that simulation finds attracts" if attracts else (
        "simulation forwards does not show what repels, and no torus attracts here"
    )  # fmt: skip
    return rule_result(
        False if attracts else None, _attractors(panels), f"{WITNESS}: {reason}", **_json(panels)
    )


# --- quantities -----------------------------------------------------------------------------------


def _size(found: LabelledAttractor) -> float:
    return extent(found.points)


def _smoothness(found: LabelledAttractor) -> float:
    curve = found.attractor.shape.curve
    assert curve is not None
    return 1.0 / harmonics(found.points[:: found.attractor.shape.pieces], curve.rotation.value)


def _width(found: LabelledAttractor) -> float:
    return width(found.points)


Measure = Callable[[LabelledAttractor], float]
_QUANTITIES: dict[str, tuple[Kind, Measure, str]] = {
    "size of the invariant circle": (Kind.QUASIPERIODIC, _size, "extent"),
    "smoothness of the invariant circle": (Kind.QUASIPERIODIC, _smoothness, "1 / harmonics"),
    "width of the chaotic belt": (Kind.CHAOTIC, _width, "width"),
}


def _measured(panel: PanelResult, kind: Kind, measure: Measure) -> float | None:
    """Measure the attractor of a kind; the one from the downward sweep, or else the first."""
    return next((measure(f) for f in panel.found if _is(f, kind)), None)


# --- words --------------------------------------------------------------------------------------


def _is(found: LabelledAttractor, kind: Kind) -> bool:
    return found.attractor.kind is kind


def _of_set(name: str, claim: Claim, evidence: Evidence) -> bool:
    return evidence.panels[name].panel.set == claim.set


def _panels(claim: Claim, evidence: Evidence) -> list[PanelResult]:
    return [evidence.panels[name] for name in claim.panels if name in evidence.panels]


def _attractors(panels: Sequence[PanelResult]) -> str:
    return listed(f"{p.panel.name}: {' | '.join(labels(p.distinct))}" for p in panels)


def _numbers_of(panels: Sequence[PanelResult]) -> str:
    """Return the numbers that decided each classification."""
    parts = []
    for p in panels:
        for group in p.distinct:
            parts.append(f"{p.panel.name}: {numbers_of(group[0].attractor)}")
    return f"{WITNESS}: " + listed(parts)


def numbers_of(a: Attractor) -> str:
    """Return the numbers that decided a classification, in words."""
    exponent = f"{_history(a)}exponent {a.exponent.value:.2g} \u00b1 {a.exponent.error:.1g}"
    if a.kind is Kind.PERIODIC:
        return f"returns within {a.shape.return_distance:.0e} after {a.shape.period}, {exponent}"
    if a.rotation is not None:
        return f"rotation number {a.rotation.value:.8f} \u00b1 {a.rotation.error:.0e}, {exponent}"
    return f"{exponent}{': ' + a.shape.reason if a.shape.reason else ''}"


def _history(a: Attractor) -> str:
    """Return the transient before the motion settled, in words."""
    if not a.transient:
        return ""
    return f"settled after {a.transient} impacts (before: {a.transient_name}), "


def _json(panels: Sequence[PanelResult]) -> dict[str, object]:
    return {
        "attractors": [
            {"panel": p.panel.name, "start": f.start, "label": f.attractor.label}
            for p in panels
            for f in p.found
        ]
    }
