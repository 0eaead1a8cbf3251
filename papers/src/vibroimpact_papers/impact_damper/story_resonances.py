"""The part of the report on strong resonance: curves over planes, true points, distances."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.normal_forms import Refusal
from vibroimpact.plotting.page import Block, Cell, Table, Text
from vibroimpact.tori.circle import Circle
from vibroimpact_papers.impact_damper.findings import Findings, Pictures
from vibroimpact_papers.impact_damper.resonances import ANGLES, Distance, Resonances
from vibroimpact_papers.impact_damper.unfolding import Unfolded, stride
from vibroimpact_papers.impact_damper.unfolding_flows import (
    STABLE_BETWEEN,
    FourFlow,
    OneFlow,
    ThreeFlow,
    TwoFlow,
)
from vibroimpact_papers.impact_damper.unfolding_motions import BLOCK


def strong_blocks(found: Findings, pictures: Pictures) -> list[Block]:
    """Return the section of the report."""
    if not found.resonances:
        return [Text(("Not computed in this run.",))]
    blocks: list[Block] = [
        Text(
            (
                "Two conditions must hold at a resonance: a pair of multipliers is on the unit "
                "circle, and its angle is a fraction of a turn. So resonances are points in a "
                "plane of two parameters. Along the frequency alone, as in the paper, one passes "
                "beside them. The second parameter here is the half clearance.",
                "The full map of the symmetric orbit is the square of its half map, so the "
                "multipliers ν of the half map decide: 1:1 (ν = 1 twice), 1:2 (ν = −1 twice), 1:3 (ν at 120°) and "
                "1:4 (ν = ±i). At ν = ±i the multipliers of the full map are both −1, with "
                "λ² = 1. λ⁴ = 1 with λ = ±i has ν at 45° or 135°: a weak resonance 1:8 or 3:8 of "
                "the half map, at which the symmetry leaves no strong term.",
            )
        )
    ]
    for name, one in found.resonances.items():
        blocks += pictures.figure(
            f"strong-{name}", f"Set {name} in the plane of both parameters",
            _caption(one, found.plan.tongues.get(name, ())),
            f"Curves of bifurcations with strong resonances of set {name} over a plane of motions",
        )  # fmt: skip
    return [
        *blocks, _points(found), _distances(found), *_unfoldings(found, pictures),
        *_families(found, pictures), *_spectra(pictures),
    ]  # fmt: skip


def _caption(one: Resonances, wanted: Sequence[tuple[int, int]]) -> str:
    across, up = one.plane["motion"].shape
    low, high = one.angles
    here = ", ".join(dict.fromkeys(_name(p) for p in one.strong)) or "none"
    tongues = "".join(map(" ".__add__, _tongues(one, wanted)))
    return (
        f"Colours: the motion on which each of {across} x {up} machines settles. Lines: "
        "Neimark-Sacker, fold and symmetry-breaking curves of the symmetric orbit. White rings: "
        "frequencies of the paper's sections; white triangles: its printed critical frequencies. "
        f"On the Neimark-Sacker curve the angle of ν runs from {low:.2f}° to {high:.2f}°; strong "
        f"resonances: {here}.{tongues}"
    )


def _tongues(one: Resonances, wanted: Sequence[tuple[int, int]]) -> list[str]:
    """Return what the plane shows between the sides of each tongue."""
    if not one.tongues:
        return []
    said = [
        "From a weak resonance p/q a tongue opens, in which orbits that close after q half periods "
        "lock the circle. Its sides are folds of these orbits; it is hatched as far as both bound it."
    ]
    place = "({omega:.6f}, {half_clearance:.6f})".format_map
    for tongue in one.tongues:
        p, q = tongue.resonance
        n = q if q % 2 else q // 2
        motions = one.between_sides(tongue)
        locked, symmetric = (motions.count(name) for name in (f"{n}-{n}-{n}", "1-1-1"))
        said.append(
            f"{p}/{q} from {place(tongue.tip.parameters)}: of {len(motions)} machines between the "
            f"sides {locked} settle on {n}-{n}-{n}, {symmetric} on 1-1-1."
        )
        said += [
            f"One side meets {place(other.parameters)}, a second tip of this tongue."
            for other in one.other_tips(tongue)
        ]
    begun = {tongue.resonance for tongue in one.tongues}
    missing = ", ".join(f"{p}/{q}" for p, q in wanted if (p, q) not in begun)
    return [*said, f"No tongue {missing} begins in this plane."] if missing else said


def _name(p: BifurcationPoint) -> str:
    return f"1:{p.kind[1:]}"


def _points(found: Findings) -> Table:
    rows: list[list[Cell]] = [
        [
            one.set, _name(p), f"{p.parameters['omega']:.9f}",
            f"{p.parameters['half_clearance']:.9f}", *coefficient(p), str(p.normal_form.meaning),
        ]
        for one in found.resonances.values()
        for p in one.strong
    ]  # fmt: skip
    head = ("set", "resonance", "ω", "half clearance", "coefficient", "modulus", "meaning")
    caption = (
        "Every strong resonance of the symmetric orbit in the planes. Coefficient: A of 1:4, "
        "negative real part: the circle attracts, modulus above 1: orbits of four half periods "
        "are born in folds; of 1:3, Re(ν̄ c / |b|² − 1) / 3, negative where the circle "
        "attracts; of 1:1 and 1:2 the two of their normal forms."
    )
    return Table(head, rows, caption=caption, stacked=True)


def coefficient(p: BifurcationPoint) -> tuple[str, str]:
    """Return the invariant coefficient of a strong resonance, and its modulus."""
    form = p.normal_form
    if p.kind == "R1" and not isinstance(form, Refusal):
        return f"{form.a:.6f}, {form.b:.6f}", "\u2013"
    scaled = getattr(form, "scaled", None)
    if isinstance(scaled, complex) and p.kind == "R3":  # its imaginary part is not invariant
        return f"{scaled.real:.6f}", "\u2013"
    if isinstance(scaled, complex):
        return f"{scaled.real:.6f} {scaled.imag:+.6f}i", f"{abs(scaled):.6f}"
    if scaled is None:
        return "\u2013", "\u2013"
    return ", ".join(f"{float(v):.6f}" for v in scaled), "\u2013"


def _distances(found: Findings) -> Table:
    rows = [_distance_row(d) for each in found.distances.values() for d in each]
    head = ("set", "point", "ω", "angle of ν", "nearest strong resonance", "in ω",
            "in half clearance", "relative", "nearest angle")  # fmt: skip
    caption = (
        "How far the bifurcation points of the paper are from a true strong resonance: printed "
        "critical frequencies, and the computed ones at the same clearance. Relative: the length "
        "of both differences, each over its value at the point."
    )
    return Table(head, rows, caption=caption, stacked=True)


def _distance_row(d: Distance) -> list[Cell]:
    angle = "real" if math.isnan(d.angle) else f"{d.angle:.3f}°"
    kind, away = d.by_angle
    by_angle = f"1:{kind[1:]} at {ANGLES[kind]:.0f}°, {away:.3f}° away"
    if d.nearest is None:
        return [d.set, d.what, f"{d.omega:.6f}", angle, "none in the plane", *["\u2013"] * 3,
                by_angle]  # fmt: skip
    at = d.nearest.parameters
    return [
        d.set, d.what, f"{d.omega:.6f}", angle,
        f"{_name(d.nearest)} at ({at['omega']:.6f}, {at['half_clearance']:.6f})",
        f"{d.in_omega:+.6f}", f"{d.in_clearance:+.6f}", f"{100.0 * d.relative:.2f}%", by_angle,
    ]  # fmt: skip


def _unfoldings(found: Findings, pictures: Pictures) -> list[Block]:
    """Return the portraits around strong resonances."""
    if not found.unfolded:
        return []
    blocks: list[Block] = [
        Text(
            (
                "Every strong resonance in the planes is shown below with its surroundings. "
                "What happens at a resonance 1:4 is decided by one number, A. Near it, in a frame "
                "that turns by a right angle each half period, the coordinate z of a motion on the "
                "centre manifold moves by z\u2032 = μ z − i c z|z|² − i d z̄³, with "
                "μ = log(ν / i). This prediction stands above simulations of the damper "
                "itself, started at the same z, at the parameters of the numbered squares, all "
                "with the same |μ|. Next to a resonance 1:3, with μ = log(ν / ν₀) and ν₀ at 120°, "
                "z\u2032 = μ z + b\u2032 z̄² + c\u2032 z|z|²; there Re c\u2032 decides.",
                "At 1:2 and 1:1 two multipliers meet, and the motion has one coordinate x and its "
                "rate. In units of x and of time that the coefficients give, "
                "x\u2033 = m₁x + m₂x\u2032 − x³ − x²x\u2032 next to the 1:2 of set C, for every "
                "second half period, and x\u2033 = m₁ + m₂x\u2032 + x² + xx\u2032 next to its 1:1; m₁ and "
                "m₂ are computed from the two multipliers. The lines of the sectors lie so near each "
                "other in ω and δ that they are drawn over m₁ and m₂.",
            )
        )
    ]
    for i, one in enumerate(found.unfolded, 1):
        name = f"1:{one.flow.order}"
        blocks += pictures.figure(
            f"unfolding-{one.set}-{i}", f"Around a resonance {name} of set {one.set}",
            _around(one),
            "Parameters around the resonance, and phase portraits predicted and simulated",
        )  # fmt: skip
    return blocks


def _around(one: Unfolded) -> str:
    """Return what the portraits around a resonance show."""
    at, flow = one.point.parameters, one.flow
    place = f"ω = {at['omega']:.6f}, half clearance {at['half_clearance']:.6f}, "
    if isinstance(flow, FourFlow):
        return place + _around_four(one, flow)
    if isinstance(flow, ThreeFlow):
        return place + _around_three(flow)
    away = max(abs(s.half_clearance - at["half_clearance"]) for s in one.sectors)
    near = f" The portraits are at half clearances within {away:.1g} of it."
    return (
        place + (_around_two(flow) if isinstance(flow, TwoFlow) else _around_one(one, flow)) + near
    )


def _rings(count: str) -> str:
    return f" Colours: radius of the start. Rings: points of period {count} by the normal form. "


def _around_three(flow: ThreeFlow) -> str:
    said = f"Re c\u2032 = {flow.cubic.real:.4f}"
    if flow.cubic.real > 0.0:
        return f"{said}: the circle repels." + _rings("three")
    return (
        f"{said}, negative: the circle attracts."
        + _rings("three")
        + "They belong to a saddle of three half periods, 3-3-3, on all sides of the point: it "
        "bounds what is attracted. Between the Neimark-Sacker curve and the dashed line, at "
        "which the circle meets the saddle by theory, a circle attracts (2, 4); beyond, nothing "
        "near the orbit does, and motions leave (3)."
    )


def _around_four(one: Unfolded, flow: FourFlow) -> str:
    said = f"|A| = {abs(flow.form.scaled):.4f}." + _rings("four")
    if not flow.form.switchable:
        return (
            f"{said}|A| < 1: no folds. A saddle of four half periods bounds what is attracted, on "
            "all sides of the point; far from the Neimark-Sacker curve nothing near it attracts, "
            "and motions leave for a 2-2-2 orbit farther out, which the first terms do not "
            "describe."
        )
    said += (
        "|A| > 1: between the two folds a node and a saddle of four half periods, 2-2-2, lie on "
        "the circle and lock it; outside, the circle attracts. Solid blue: the folds, computed on "
        "the orbits themselves; dashed: their directions by theory."
    )
    numbers = [str(i) for i, s in enumerate(one.sectors, 1) if s.words == STABLE_BETWEEN]
    if numbers:
        said += (
            f" One fold is on the stable side of the Neimark-Sacker curve: in ({', '.join(numbers)}) "
            "the symmetric orbit and the node both attract, and the saddle divides their starts."
        )
    return said


def _around_two(flow: TwoFlow) -> str:
    c, d = flow.cubic
    return (
        f"C = {c:.5f}, D = {d:.4f}: both negative."
        + _rings("two")
        + "They are the doubled orbit of "
        "the half map: two 1-1-1 motions that are mirror images, where the symmetric one has lost "
        "its symmetry (m₁ > 0). Clockwise from (1): the symmetric orbit is stable; a circle "
        "attracts (2), and goes around all three orbits once symmetry is broken (3); the doubled "
        "orbit becomes stable inside two small circles that repel (4); these join in a figure "
        "eight, and one large circle that repels is inside that which attracts (5); both meet, and "
        "the doubled orbit alone attracts (6). Solid blue: where its multipliers leave the unit "
        "circle, computed on the orbits themselves. Points are "
        f"{stride(flow)} half periods apart; their mirror images are shown, too."
    )


def _around_one(one: Unfolded, flow: OneFlow) -> str:
    a, b = flow.quadratic
    outside = float(np.abs(one.point.normal_form.multipliers).max())
    return (
        f"A = {a:.4f}, B = {b:.4f}: of one sign, so the circle repels. Rings: the two symmetric "
        "orbits, the saddle on the right; they meet in the fold, beyond which motions pass by (1). "
        "The other orbit is unstable on the centre manifold (2) or, below the Neimark-Sacker curve, "
        "stable inside a circle (3), which ends at a homoclinic orbit of the saddle (4). "
        f"Another multiplier of the half map, {outside:.4f}, is outside the unit circle, and every "
        "motion would leave the manifold. The simulated ones are held on it: once in "
        f"{BLOCK} half periods the state is changed along the unstable direction, by less than "
        f"10⁻³ of the distance between both orbits. Points are {stride(flow)} half periods apart."
    )


def _spectra(pictures: Pictures) -> list[Block]:
    """Return the Lyapunov exponents along the routes."""
    return pictures.figure(
        "spectra", "All Lyapunov exponents along each route",
        "From the states reached by following the attractor down, with statistical errors. All "
        "below zero: a periodic motion; the largest zero: a circle; above zero: chaos. The time "
        "shift, whose exponent is zero, is not counted.",
        "Four Lyapunov exponents over the frequency, for each set",
    )  # fmt: skip


def _families(found: Findings, pictures: Pictures) -> list[Block]:
    """Return the circles that were followed, where they break, and what locks them."""
    if not found.families:
        return []
    blocks: list[Block] = [
        Text(
            (
                "The closed curves of Figs. 2, 4 and 5 can be computed as curves: a circle is a "
                "function u of its phase φ with H(u(φ)) = u(φ + ρ), where H is the half map and "
                "ρ the rotation number in turns per half period. It is solved by Newton's "
                "method and followed along the frequency, whether it attracts or not. Its normal "
                "multipliers say how disturbances across it grow: 1 is a fold of circles, −1 a "
                "doubling of the torus. Where the angle α between the circle and its stable "
                "directions tends to zero, or its harmonics fall ever more slowly, it breaks.",
            )
        )
    ]
    for name in found.families:
        blocks += pictures.figure(
            f"families-{name}", f"Circles of set {name}",
            "Sections: lines are computed circles, broad dots simulated points. Rotation number "
            "along the family, with the locked motions of other panels. Last: the leading "
            "normal multiplier and the sine of the least angle.",
            f"Computed circles of set {name} over simulated points, with rotation numbers",
        )  # fmt: skip
    ends: list[list[Cell]] = []
    for f in found.families.values():
        low, high = f.span
        least, most = float(f.leading.min()), float(f.leading.max())
        ends.append([
            f.set, f"{low:.6f} to {high:.6f}", f"{least:.4f} to {most:.4f}",
            f"{float(f.least_angles.min()):.4f}", f.end,
        ])  # fmt: skip
    rows = [_circle_row(n, c, f.locked) for f in found.families.values()
            for n, c in f.at_panels.items()]  # fmt: skip
    folds = tuple(
        f"The circles that are born at {name}, next to a strong resonance, end in a fold at "
        f"ω = {fold.parameter:.9f}: there an attracting and a repelling circle meet; beyond it "
        "neither exists."
        for name, fold in found.circle_folds.items()
    )
    return [
        *blocks,
        *([Text(folds)] if folds else []),
        Table(("set", "ω of the family", "leading multiplier", "least sin α", "lower end"), ends,
              caption="The families, and why each ends at its lowest frequency.", stacked=True),
        Table(("panel", "ω", "ρ of the half map", "leading multiplier", "sin α", "what is found"),
              rows, caption="The circle at each panel, from one start, or why there is none. "
              "Locked p/q: a periodic motion of q half periods that goes round p times.",
              stacked=True),
    ]  # fmt: skip


def _circle_row(name: str, c: Circle, locked: Mapping[str, tuple[int, int]]) -> list[Cell]:
    omega = f"{c.value:.10g}" if c.parameter else f"{getattr(c.system, 'omega', math.nan):.10g}"
    if not c.converged:
        p, q = locked.get(name, (0, 0))
        end = f"; locked {p}/{q}" if q > 1 else ""
        return [name, omega, *["\u2013"] * 3, c.status + end]
    lead = complex(c.normal_multipliers[0])
    return [name, omega, f"{c.rotation_number:.12f}", f"{abs(lead):.6f}", f"{c.least_angle:.4f}",
            f"circle of {c.nodes} nodes, {c.stability.words}"]  # fmt: skip


def strong_record(found: Findings) -> list[dict[str, object]]:
    """Return the strong resonances and the distances from them as plain data."""
    return [
        {
            "set": name,
            "angle_range_degrees": list(one.angles),
            "points": [
                {"kind": p.kind, **p.parameters, "coefficient": coefficient(p)[0]}
                for p in one.strong
            ],
            "distances": [
                {
                    "point": d.what,
                    "omega": d.omega,
                    "angle_of_nu_degrees": d.angle,
                    "nearest": d.nearest.kind if d.nearest else "none",
                    "in_omega": d.in_omega,
                    "in_half_clearance": d.in_clearance,
                    "nearest_angle": d.by_angle[0],
                    "from_nearest_angle_degrees": d.by_angle[1],
                }
                for d in found.distances[name]
            ],
        }
        for name, one in found.resonances.items()
    ]
