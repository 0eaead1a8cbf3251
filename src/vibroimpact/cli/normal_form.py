"""Command vibroimpact normal-form: normal form at a bifurcation, with side and size."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from typing import Any

import numpy as np

from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.cli import common
from vibroimpact.cli.branch import add_branch, branches_of
from vibroimpact.cli.output import Done
from vibroimpact.normal_forms import (
    BranchPoint,
    CentreManifold,
    ChatterEnd,
    Flip,
    NeimarkSacker,
    Refusal,
    Scenario,
    Touch,
    centre_manifold,
    resonances,
)
from vibroimpact.normal_forms.touch import SQUARE_ROOT
from vibroimpact.orbits.maps import SegmentMap, solved_map

EXAMPLE = "  vibroimpact normal-form impact-damper/A --bounds omega=0.9:1.2 --at NS1"
COEFFICIENTS = ("nu", "a", "b", "c", "d", "e", "twist", "f1", "multiplier_slopes")
OF_FORM = (*COEFFICIENTS[1:], "pitchfork", "supercritical", "attracting", "side", "warnings")
TURNS_TOLD = 6  # windows of period adding are told up to one impact in so many turns
WINDOWED = (Scenario.OVERLAPPING, Scenario.ADDING)
BORN = {
    "NS": "a circle", "PD": "an orbit of twice the period", "SN": "two orbits",
    "BP": "two orbits, mirror images of each other",
}  # fmt: skip

Facts = dict[str, Any]


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    add_branch(parser)
    parser.add_argument(
        "--at", required=True, metavar="POINT",
        help="a special point of the branch, or of the last one that was switched to: NS1, PD1, "
        "SN1, BP1, GR1, ...",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print the numbers as JSON")


def run(arguments: argparse.Namespace) -> Done:
    """Compute the normal form."""
    point = branches_of(arguments)[-1][arguments.at]
    form = point.normal_form
    if isinstance(form, Refusal):
        raise common.Failure(
            f"{point.label} at {point.name} = {point.parameter:.12g}: {form.reason}"
        )
    if isinstance(form, Touch):
        told = (
            [json.dumps(_of_touch(point, form), indent=2)]
            if arguments.json
            else _about(point, form)
        )
        return Done([*told], form)
    if isinstance(form, ChatterEnd):
        return Done([json.dumps(_of_chatter(point, form), indent=2)] if arguments.json else [form])
    facts = _facts(point, form)
    return Done([json.dumps(facts, indent=2)] if arguments.json else [point, *_words(facts)])


# ---- the numbers ---------------------------------------------------------------------------------


def _of_point(point: BifurcationPoint, form: Any, coordinates: Iterable[str]) -> Facts:
    """What is said of every point: where it is, of which orbit, and by which map it is judged."""
    return {
        "point": point.label,
        "kind": point.kind,
        "parameter": point.name,
        "value": point.parameter,
        "error": point.error,
        "orbit": point.orbit.symbol,
        "admissible": point.admissible,
        "map": "half map" if point.orbit.symmetric else "full map",
        "coordinates": [*coordinates],
        "multipliers": [_plain(value) for value in form.multipliers],
    }


def _facts(point: BifurcationPoint, form: Any) -> Facts:
    """Lines of what the form says, and where: a size w, or the radius of a circle, is a law times sqrt|dp|."""
    solved = solved_map(point.orbit, point.name)
    forked = not isinstance(form, BranchPoint) or form.pitchfork
    of_form = [name for name in OF_FORM if forked or name not in ("supercritical", "side")]
    facts: Facts = (
        _of_point(point, form, _coordinates(solved))
        | {
            "others_inside": form.others_inside,
            "nu": _plain(complex(-1.0 if isinstance(form, Flip) else 1.0)),
        }
        | {name: _plain(getattr(form, name)) for name in of_form if hasattr(form, name)}
    )
    if isinstance(form, NeimarkSacker):
        facts |= _of_circle(form, solved)
    elif forked:
        size = form.size(float(form.side))
        facts |= {"radius_law": size, "half_width_law": (size * np.abs(form.q)).tolist()}
    if isinstance(form, Flip):
        facts["growth"] = -form.multiplier_slope
    return facts


def _of_circle(form: NeimarkSacker, solved: SegmentMap) -> Facts:
    unit, near, reduced = float(form.side), form.resonance, centre_manifold(solved)
    trusted = form.resonant_radius
    return {
        "nu": _plain(form.multiplier),
        "f1": reduced.f1
        if isinstance(reduced, CentreManifold)
        else None,  # -Re(d) by another route
        "angle_degrees": math.degrees(form.angle),
        "growth": form.kappa.real,
        "turning": form.kappa.imag,
        "radius_law": form.radius(unit),
        "half_width_law": form.amplitude(unit).tolist(),
        "angle_slope": (form.turn(unit) - form.angle) / unit,
        "nearest_resonance": [near.p, near.q],
        "resonance_distances": {
            f"{r.p}/{r.q}": r.distance for r in resonances(form.angle) if r.strong or r == near
        },
        "trusted_below_radius": trusted if math.isfinite(trusted) else None,
    }


def _of_touch(point: BifurcationPoint, form: Touch) -> Facts:
    """What the form at a touch says; sizes of speeds are those of impacts."""
    rigid = form.power == SQUARE_ROOT
    windows = form.windows(TURNS_TOLD) if rigid else ()
    return _of_point(point, form, form.coordinates) | {
        "stop": form.stop,
        "law": form.law.value,
        **{name: _plain(value) for name, value in form.numbers.items()},
        "scenario": form.scenario.name,
        "meaning": form.meaning,
        "linear": form.linear.tolist(),
        "jump": form.jump.tolist(),
        "gap": form.gap.tolist(),
        "added": form.added()._asdict(),
        "windows": [{name: _finite(x) for name, x in w._asdict().items()} for w in windows],
    }


def _of_chatter(point: BifurcationPoint, form: ChatterEnd) -> Facts:
    """What is said of an end of completed chatter."""
    return {
        "point": point.label,
        **asdict(form),
        "error": point.error,
        "orbit": point.orbit.symbol,
        "shrinking": form.shrinking,
        "ratio": form.ratio,
        "power": form.power,
        "meaning": form.meaning,
    }


def _finite(value: Any) -> Any:
    """A value of JSON, which has no infinity."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _about(point: BifurcationPoint, form: Touch) -> Iterator[Any]:
    """The point, the coefficients, what follows, and the windows of period adding."""
    yield point
    yield f"{point.orbit.symbol} orbit, {form.stop}, {form.law.value}, in {', '.join(form.coordinates)}"
    yield ", ".join(f"{name} = {_text(value)}" for name, value in form.numbers.items())
    yield f"multipliers {_text([_plain(value) for value in form.multipliers])}"
    yield from form.meaning.split("; ")
    for w in form.windows(TURNS_TOLD) if form.scenario in WINDOWED else ():
        ends = ", ".join(end for end in (w.slow_end, w.fast_end) if end)
        yield f"one impact in {w.turns}: {point.name} - {point.parameter:.9g} from {w.low:.6g} to {w.high:.6g} ({ends})"


def _coordinates(solved: SegmentMap) -> list[str]:
    """Names of the coordinates of the map."""
    n = solved.compiled.degrees
    names = [f"{kind}{i + 1}" for kind in "xv" for i in range(n)] + ["phase"]
    return [names[i] for i in solved.kept_in]


def _plain(value: Any) -> Any:
    """A value of JSON; of a complex number its real and imaginary part."""
    if isinstance(value, complex | np.complexfloating):
        return [float(value.real), float(value.imag)]
    return list(value) if isinstance(value, tuple) else value


# ---- the words -----------------------------------------------------------------------------------


def _words(facts: Facts) -> Iterator[str]:
    """Coefficients, what is born, its size, and warnings, a line each."""
    yield f"{facts['orbit']} orbit, {facts['map']} in {', '.join(facts['coordinates'])}"
    yield ", ".join(f"{name} = {_text(facts[name])}" for name in COEFFICIENTS if name in facts)
    place = f"{facts['parameter']} {'>' if facts.get('side', 0) > 0 else '<'} {facts['value']:.9g}"
    if not facts.get("pitchfork", True):
        yield "transcritical"
        return
    pitchfork = "pitchfork, " if "pitchfork" in facts else ""
    if "supercritical" in facts:
        attracts = facts.get("attracting", facts["supercritical"] and facts["others_inside"])
        yield (
            f"{pitchfork}{'super' if facts['supercritical'] else 'sub'}critical: {_born(facts)}, "
            f"{'attracting' if attracts else 'not attracting'}, for {place}"
        )
    else:
        yield f"{_born(facts)} for {place}"
    name, dp = "r" if facts["kind"] == "NS" else "w", f"{facts['parameter']} - {facts['value']:.9g}"
    yield f"{name} = {facts['radius_law']:.9g} sqrt|dp|, dp = {dp}"
    widths = zip(facts["coordinates"], facts["half_width_law"], strict=True)
    yield f"half width / sqrt|dp|: {', '.join(f'{one} {width:.6g}' for one, width in widths)}"
    if facts["kind"] == "NS":
        angle, (p, q) = math.radians(facts["angle_degrees"]), facts["nearest_resonance"]
        near = ", ".join(f"{name} {d:.4g}" for name, d in facts["resonance_distances"].items())
        yield f"angle per iterate on it: {angle:.9g} {facts['angle_slope']:+.6g} dp radians"
        yield f"nearest resonance {p}/{q}; distances |nu^q - 1|: {near}"
    yield from (f"warning: {sentence}" for sentence in facts.get("warnings", []))


def _born(facts: Facts) -> str:
    return BORN["SN"] if "pitchfork" in facts else BORN[facts["kind"]]


def _text(value: Any) -> str:
    """A number; of several, or of a complex one, the numbers."""
    if value is None:
        return "refused"
    if isinstance(value, list):
        return f"({', '.join(map(_text, value))})"
    return f"{value:.12g}"
