"""Regenerate tests/reference/*.toml from the high-precision references.

    python tools/reference_values.py [bifurcations] [orbits] [chatter] [misprints]
                                     [derivatives] [normal_forms] [periodic]

Without arguments all files named are written; `bifurcations` and `derivatives` take a minute or
two. Needs mpmath only.
`published.toml` holds values from the literature and is not generated; `auto.toml` is written by
`auto07p/run.py`.
"""

from __future__ import annotations

import sys

from reference_maps import derivative_table, normal_form_table, periodic_table
from reference_toml import TESTS, header, text, texts
from witness.bifurcations import Point, bifurcations
from witness.damper import PAPER_SETS, Damper, Event, paper_set, simulate, state
from witness.misprints import all_entries
from witness.precision import decimal, mp
from witness.symmetric import half_multipliers, inadmissible, orbit

RANGES = {"A": ("0.5", "1.5"), "B": ("0.5", "1.5"), "C": ("0.3", "0.6")}
STEPS = (300, 431)  # two grids that share no inner point must find the same points
ORBITS = {
    "A": ("0.75", "0.95", "1.0", "1.01962", "1.2", "1.4"),
    "B": ("0.8", "0.937", "0.975", "1.1", "1.2"),
    "C": ("0.315", "0.418", "0.4268", "0.448", "0.5"),
}
CHATTER = (  # x1, v1, x2, v2, phase, stop the motion starts on, impacts; all exact in binary
    (1.75, 0.75, 7.75, 0.6875, 2.6875, "A", 130),
    (2.25, 0.0, 8.25, -0.34375, 4.375, "A", 136),
    (-1.125, 0.375, 0.921875, -1.828125, 0.359375, "", 275),
    (-0.875, 0.46875, 1.53125, -1.34375, 3.25, "", 150),
)
CHATTER_OMEGA = 0.4205
AFTER = 5  # impacts recorded after a release
NUDGE = "1e-25"  # of x2' at the start, to measure how errors grow


def bifurcation_table() -> list[str]:
    """All bifurcations of the symmetric 1-1-1 orbits of the paper's sets."""
    out = header(
        "nu: multipliers of the half map; critical: the one on the unit circle; lambda = nu^2.",
        "angle: of nu, degrees. stable: the side of omega_c on which the orbit is stable.",
        "growth: d|nu|/d omega of the critical pair. A fold (SN) is listed once, for both signs.",
    )
    for name, (low, high) in RANGES.items():
        grids = [bifurcations(paper_set(name, 1), low, high, steps=n) for n in STEPS]
        counts = [[(p.kind, p.sign, decimal(p.omega, 40)) for p in g] for g in grids]
        if counts[0] != counts[1]:
            raise RuntimeError(f"set {name}: the grids disagree: {counts}")
        out += ["", f"[ranges.{name}]", f'omega = ["{low}", "{high}"]', f"count = {len(grids[0])}"]
        for point in grids[0]:
            out += point_table(name, point)
    return out


def point_table(name: str, p: Point) -> list[str]:
    """One bifurcation."""
    lam = p.critical**2
    at_fold = p.kind == "SN"  # there nu is the root of a rounding error away from 1
    nu = mp.mpc(1) if at_fold else p.critical
    angle = mp.degrees(mp.arg(nu)) if p.kind == "NS" else (0 if at_fold else 180)
    return [
        "", "[[bifurcation]]", f'set = "{name}"', f'kind = "{p.kind}"', f"sign = {p.sign}",
        f"omega = {text(p.omega)}",
        f"nu = {texts((nu.real, nu.imag))}",
        f"lambda = {texts((1, 0) if p.kind != 'NS' else (lam.real, lam.imag))}",
        f"angle = {text(angle)}",
        *([f"growth = {text(p.growth)}"] if p.kind == "NS" else []),
        f"moduli = [{', '.join(f'{float(abs(v)):.12f}' for v in p.multipliers)}]",
        f'stable = "{p.stable}"',
        f"admissible = {str(p.inadmissible is None).lower()}",
    ]  # fmt: skip


def orbit_table() -> list[str]:
    """Symmetric orbits: state on stop A after impact, multipliers of the half map."""
    out = header(
        "State (x1, v1, x2, v2, sin(theta), cos(theta)) on stop A after impact; nu of the half map."
    )
    for name, omegas in ORBITS.items():
        for omega in omegas:
            for sign in (1, -1):
                found = orbit(paper_set(name, omega), sign)
                out += ["", "[[orbit]]", f'set = "{name}"', f'omega = "{omega}"', f"sign = {sign}"]
                out.append(f"exists = {str(found is not None).lower()}")
                if found is None:
                    continue
                z, nu = found.state, half_multipliers(found)
                reason = inadmissible(found)
                out += [
                    f"state = {texts((z.x1, z.v1, z.x2, z.v2, z.s, z.c))}",
                    f"phase = {text(z.phase)}",
                    f"nu_real = {texts([v.real for v in nu])}",
                    f"nu_imag = {texts([v.imag for v in nu])}",
                    f"stable = {str(abs(nu[0]) < 1).lower()}",
                    f"admissible = {str(reason is None).lower()}",
                    *([f'reason = "{reason}"'] if reason else []),
                ]
    return out


def chatter_table() -> list[str]:
    """Complete chatter, sticking and release in set C."""
    values = {k: float(v) for k, v in PAPER_SETS["C"].items()}
    out = header(
        f"Set C at omega = {CHATTER_OMEGA}; every parameter is the double nearest to its decimal.",
        "Starts are exact doubles. States: x1, v1, x2, v2, sin(theta), cos(theta).",
        "from_stop is empty for a start inside the clearance. impact_times: up to the chatter, of",
        "the impacts closing faster than 0.01; the others are within the chatter.",
        "growth: shift of chatter_time, release_time, last next_time per shift of v2 at the start.",
    )
    out += [
        "",
        "[parameters]",
        f"omega = {CHATTER_OMEGA}",
        *(f"{k} = {v!r}" for k, v in values.items()),
    ]
    damper = Damper(**values, omega=CHATTER_OMEGA)
    for x1, v1, x2, v2, phase, stop, impacts in CHATTER:
        runs = [
            simulate(
                damper, state(x1, v1, x2, v2 - nudge, phase=phase), impacts, from_stop=stop or None
            )  # type: ignore[arg-type]
            for nudge in (0, mp.mpf(NUDGE))
        ]
        out += [
            "",
            "[[case]]",
            f"start = {[x1, v1, x2, v2]}",
            f"phase = {phase}",
            f'from_stop = "{stop}"',
        ]
        out += chatter_case(runs[0])
        out.append(f"growth = [{', '.join(growth(runs))}]")
    return out


def growth(runs: list[list[Event]]) -> list[str]:
    """How a deviation of v2 grows up to the chatter, the release and the last impact recorded."""
    at = [next(i for i, e in enumerate(r) if e.kind == "chatter") for r in runs]
    steps = (0, 1, 1 + AFTER)
    shifts = (abs(runs[0][at[0] + k].time - runs[1][at[1] + k].time) for k in steps)
    return [f"{float(s / mp.mpf(NUDGE)):.2e}" for s in shifts]


def chatter_case(events: list[Event]) -> list[str]:
    """The first chatter of a motion, what follows it, and the impacts well before it."""
    at = next(i for i, e in enumerate(events) if e.kind == "chatter")
    sequence = [e for e in events[:at] if abs(e.before.v2 - e.before.v1) > 0.01]
    out = [
        f"impact_times = {texts([e.time for e in sequence])}  # closing speed above 0.01",
        f"impact_stops = {[e.stop for e in sequence]}".replace("'", '"'),
        f'stop = "{events[at].stop}"',
    ]
    for e in events[at : at + 2]:
        z = e.after
        out += [
            f"{e.kind}_time = {text(e.time)}",
            f"{e.kind}_state = {texts((z.x1, z.v1, z.x2, z.v2, z.s, z.c))}",
        ]
    after = events[at + 2 : at + 2 + AFTER]
    out += [
        f"next_times = {texts([e.time for e in after])}",
        f"next_stops = {[e.stop for e in after]}".replace("'", '"'),
    ]
    return out


def misprint_table() -> list[str]:
    """Residuals of the paper's equations."""
    out = header(
        "Residuals: of the equation as printed, and as it holds (to 50 digits: below 1e-45)."
    )
    for e in all_entries():
        printed = "inf" if mp.isinf(e.printed) else decimal(e.printed, 12)
        out += [
            "",
            "[[misprint]]",
            f'where = "{e.where}"',
            f'what = "{e.what}"',
            f'printed = "{printed}"',
            f'holds = "{decimal(e.holds, 2)}"',
        ]
    return out


TABLES = {
    "bifurcations": bifurcation_table,
    "orbits": orbit_table,
    "chatter": chatter_table,
    "misprints": misprint_table,
    "derivatives": derivative_table,
    "normal_forms": normal_form_table,
    "periodic": periodic_table,
}


def main(names: list[str]) -> None:
    """Write the files named, or all."""
    unknown = set(names) - set(TABLES)
    if unknown:
        sys.exit(f"unknown: {', '.join(sorted(unknown))}; choose from {', '.join(TABLES)}")
    for name in names or TABLES:
        path = TESTS / "reference" / f"{name}.toml"
        path.write_text("\n".join(TABLES[name]()) + "\n", encoding="utf-8")
        print(f"wrote {path.name}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
