"""Command vibroimpact normal-form: normal form at a bifurcation, with side and size."""

from __future__ import annotations

import argparse
import json
import math
from typing import Any

import numpy as np

from vibroimpact.branches.branch import BifurcationPoint
from vibroimpact.cli import common
from vibroimpact.cli.branch import add_branch, branches_of
from vibroimpact.normal_forms import (
    BranchPoint,
    CentreManifold,
    Flip,
    Fold,
    NeimarkSacker,
    NormalForm,
    Refusal,
    centre_manifold,
    resonances,
)
from vibroimpact.orbits.maps import SegmentMap, solved_map

EXAMPLE = "  vibroimpact normal-form impact-damper/A --range 0.9 1.2 --at NS1"
BORN = {
    "PD": "an orbit of twice the period",
    "BP": "two orbits, mirror images of each other",
}

Facts = dict[str, Any]


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    add_branch(parser)
    parser.add_argument(
        "--at", required=True, metavar="POINT",
        help="a special point of the branch, or of the last one that was switched to: NS1, PD1, "
        "SN1, BP1, ...",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print the numbers as JSON")


def run(arguments: argparse.Namespace) -> str:
    """Compute the normal form and describe it."""
    point = branches_of(arguments)[-1][arguments.at]
    form = point.normal_form
    if isinstance(form, Refusal):
        raise common.Failure(
            f"{point.label} at {point.name} = {point.parameter:.12g}: {form.reason}"
        )
    facts = _facts(point, form)
    return json.dumps(facts, indent=2) if arguments.json else _text(point, facts)


# ---- the numbers ---------------------------------------------------------------------------------


def _facts(point: BifurcationPoint, form: NormalForm) -> Facts:
    solved = solved_map(point.orbit, point.name)
    facts = {
        "point": point.label,
        "kind": point.kind,
        "parameter": point.name,
        "value": point.parameter,
        "error": point.error,
        "orbit": point.orbit.symbol,
        "admissible": point.admissible,
        "map": "half map" if point.orbit.symmetric else "full map",
        "coordinates": _coordinates(solved),
        "multipliers": [_pair(value) for value in form.multipliers],
        "others_inside": form.others_inside,
    }
    if isinstance(form, NeimarkSacker):
        facts |= _of_circle(form, solved)
    elif isinstance(form, Flip):
        facts |= _of_flip(form)
    elif isinstance(form, Fold):
        facts |= _of_fold(form)
    elif isinstance(form, BranchPoint):
        facts |= _of_crossing(form)
    return facts


def _coordinates(solved: SegmentMap) -> list[str]:
    """Names of the coordinates of the map."""
    n = solved.compiled.degrees
    names = [f"{kind}{i + 1}" for kind in "xv" for i in range(n)] + ["phase"]
    return [names[i] for i in solved.kept_in]


def _of_circle(form: NeimarkSacker, solved: SegmentMap) -> Facts:
    unit = float(form.side)
    near = form.resonance
    return {
        "nu": _pair(form.multiplier),
        "angle_degrees": math.degrees(form.angle),
        "d": _pair(form.d),
        "f1": _second_route(solved),
        "twist": form.twist,
        "supercritical": form.supercritical,
        "attracting": form.attracting,
        "side": form.side,
        "growth": form.kappa.real,
        "turning": form.kappa.imag,
        "radius_law": form.radius(unit),
        "half_width_law": form.amplitude(unit).tolist(),
        "angle_slope": (form.turn(unit) - form.angle) / unit,
        "nearest_resonance": [near.p, near.q],
        "resonance_distances": {
            f"{r.p}/{r.q}": r.distance for r in resonances(form.angle) if r.strong or r == near
        },
        "trusted_below_radius": form.resonant_radius
        if math.isfinite(form.resonant_radius)
        else None,
        "warnings": list(form.warnings),
    }


def _second_route(solved: SegmentMap) -> float | None:
    """-Re(d) from the graph of the centre manifold; None where that is refused."""
    reduced = centre_manifold(solved)
    return reduced.f1 if isinstance(reduced, CentreManifold) else None


def _of_flip(form: Flip) -> Facts:
    size = form.size(float(form.side))
    return {
        "nu": _pair(-1.0),
        "c": form.c,
        "supercritical": form.supercritical,
        "attracting": form.attracting,
        "side": form.side,
        "growth": -form.multiplier_slope,
        "radius_law": size,
        "half_width_law": (size * np.abs(form.q)).tolist(),
    }


def _of_fold(form: Fold) -> Facts:
    size = form.size(float(form.side))
    return {
        "nu": _pair(1.0),
        "a": form.a,
        "side": form.side,
        "radius_law": size,
        "half_width_law": (size * np.abs(form.q)).tolist(),
    }


def _of_crossing(form: BranchPoint) -> Facts:
    facts: Facts = {
        "nu": _pair(1.0), "a": form.a, "b": form.b, "c": form.c, "e": form.e,
        "pitchfork": form.pitchfork, "multiplier_slopes": list(form.multiplier_slopes),
    }  # fmt: skip
    if not form.pitchfork:
        return facts
    size = form.size(float(form.side))
    return facts | {
        "supercritical": form.supercritical,
        "side": form.side,
        "radius_law": size,
        "half_width_law": (size * np.abs(form.q)).tolist(),
    }


def _pair(value: complex) -> list[float]:
    """Real and imaginary part of a number."""
    return [complex(value).real, complex(value).imag]


# ---- the words -----------------------------------------------------------------------------------


def _text(point: BifurcationPoint, facts: Facts) -> str:
    kind = {"NS": _circle_text, "PD": _flip_text, "SN": _fold_text}
    flips = facts["kind"] == "BP" and "attracting" in facts
    words = _flip_text if flips else kind.get(facts["kind"], _crossing_text)
    lines = [
        repr(point),
        f"{facts['orbit']} orbit, {facts['map']} in {', '.join(facts['coordinates'])}",
        *words(facts),
        *(f"warning: {sentence}" for sentence in facts.get("warnings", [])),
    ]
    return "\n".join(lines)


def _circle_text(facts: Facts) -> list[str]:
    p, q = facts["nearest_resonance"]
    second = facts["f1"]
    other = (
        "refused"
        if second is None
        else f"{-second:.12g}, apart by {abs(second + facts['d'][0]):.1e}"
    )
    angle = math.radians(facts["angle_degrees"])
    distances = ", ".join(f"{name} {d:.4g}" for name, d in facts["resonance_distances"].items())
    return [
        f"nu = {_complex(facts['nu'])}, angle {facts['angle_degrees']:.9g} degrees; nearest "
        f"resonance {p}/{q}",
        f"d = {_complex(facts['d'])}; Im d / Re d = {facts['twist']:.9g}",
        f"Re d from the graph of the centre manifold: {other}",
        _born("a circle", facts),
        *_size("r = ", facts),
        f"angle per iterate on it: {angle:.9g} {facts['angle_slope']:+.6g} dp radians",
        f"resonance distances |nu^q - 1|: {distances}",
    ]


def _flip_text(facts: Facts) -> list[str]:
    born = BORN[facts["kind"]]
    return [f"nu = -1, c = {facts['c']:.12g}", _born(born, facts), *_size("w = ", facts)]


def _fold_text(facts: Facts) -> list[str]:
    way = ">" if facts["side"] > 0 else "<"
    return [
        f"nu = 1, a = {facts['a']:.12g}",
        f"two orbits for {facts['parameter']} {way} {facts['value']:.9g}",
        *_size("w = ", facts),
    ]


def _crossing_text(facts: Facts) -> list[str]:
    numbers = ", ".join(f"{name} = {facts[name]:.9g}" for name in "abce")
    slopes = ", ".join(f"{slope:.9g}" for slope in facts["multiplier_slopes"])
    lines = [f"nu = 1, {numbers}", f"derivative of the multiplier along the branches: {slopes}"]
    if not facts["pitchfork"]:
        return ["transcritical", *lines]
    return ["pitchfork", *lines, _born("two orbits", facts), *_size("w = ", facts)]


def _born(what: str, facts: Facts) -> str:
    """Criticality, attraction and side of the new solutions in a sentence."""
    verdict = "supercritical" if facts["supercritical"] else "subcritical"
    way = ">" if facts["side"] > 0 else "<"
    attracts = facts.get("attracting", facts["supercritical"] and facts["others_inside"])
    return (
        f"{verdict}: {what}, {'attracting' if attracts else 'not attracting'}, for "
        f"{facts['parameter']} {way} {facts['value']:.9g}"
    )


def _size(name: str, facts: Facts) -> list[str]:
    """Square-root law of the size, and the half width in each coordinate."""
    widths = zip(facts["coordinates"], facts["half_width_law"], strict=True)
    return [
        f"{name}{facts['radius_law']:.9g} sqrt|dp|, dp = {facts['parameter']} - "
        f"{facts['value']:.9g}",
        "half width / sqrt|dp|: " + ", ".join(f"{c} {width:.6g}" for c, width in widths),
    ]


def _complex(pair: list[float]) -> str:
    return f"{pair[0]:.12g}{pair[1]:+.12g}j"
