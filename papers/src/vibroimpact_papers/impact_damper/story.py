"""Report: the order of figures and tables, and the sentences that explain them."""

from __future__ import annotations

from collections.abc import Sequence

from vibroimpact import _kernel
from vibroimpact.plotting.page import Block, Cell, Page, Score, Section, Table, Text
from vibroimpact_papers.impact_damper import TITLE as PAPER
from vibroimpact_papers.impact_damper.datasets import nearest_resonance
from vibroimpact_papers.impact_damper.findings import Findings, Pictures, Residual
from vibroimpact_papers.impact_damper.judge_motions import numbers_of
from vibroimpact_papers.impact_damper.panel_results import PanelResult
from vibroimpact_papers.impact_damper.story_circles import circle_blocks
from vibroimpact_papers.impact_damper.story_ensembles import ensemble_blocks
from vibroimpact_papers.impact_damper.story_resonances import strong_blocks
from vibroimpact_papers.impact_damper.symmetric_bifurcations import Bifurcation
from vibroimpact_papers.impact_damper.transient import PANEL, Survivors
from vibroimpact_papers.judged import Judgement, Word, score

TITLE = "The impact damper: a paper redone"
NAMES = {"SN": "fold", "BP": "symmetry breaking", "NS": "Neimark-Sacker"}
SECTIONS = (
    ("3", "", "Section 3: the symmetric orbit"),
    ("4", "", "Section 4: the normal form and the circle"),
    ("5.1", "A", "Section 5.1: set A, text"),
    ("caption", "A", "Set A: captions of Fig. 2"),
    ("5.2", "B", "Section 5.2: set B, text"),
    ("caption", "B", "Set B: captions of Figs. 3(a) and 4"),
    ("5.2", "C", "Section 5.2: set C, text"),
    ("caption", "C", "Set C: captions of Figs. 3(b) and 5"),
    ("6", "", "Section 6: conclusion"),
    ("6", "C", "Section 6: conclusion, set C"),
)


def page(
    found: Findings, judgements: tuple[Judgement, ...], residuals: Sequence[Residual],
    pictures: Pictures,
) -> Page:  # fmt: skip
    """Return the whole report."""
    return Page(
        title=TITLE,
        opening=[
            _opening(judgements, residuals),
            Score({word.badge: count for word, count in score(judgements).items()}),
        ],
        sections=[
            _differences(judgements),
            Section("The mechanism", _mechanism(pictures), "mechanism"),
            Section("How it moves", _motion(pictures), "motion"),
            Section("Multipliers of the symmetric orbit", _paths(pictures), "multipliers"),
            Section("Every bifurcation of the symmetric orbit", _tables(found), "bifurcations"),
            Section("The circles that are born", circle_blocks(found, pictures), "circles"),
            Section("Fig. 2: set A", _panels(found, pictures, "2", "A"), "figure-two"),
            Section("Fig. 4: set B", _panels(found, pictures, "4", "B"), "figure-four"),
            Section("Fig. 5: set C", _panels(found, pictures, "5", "C"), "figure-five"),
            Section("Attractors along the frequency", _diagrams(found, pictures), "diagrams"),
            Section("Around the paper's frequencies", ensemble_blocks(found, pictures), "planes"),
            Section("Strong resonance", strong_blocks(found, pictures), "strong"),
            Section("Every claim and its verdict", _verdicts(judgements), "verdicts"),
            Section("Misprinted equations", _misprints(residuals), "misprints"),
            Section("How the figures were made", _method(found), "method"),
        ],
        footer=f"Written by vibroimpact {_kernel.version()}. No random numbers: every run gives "
        "the same data. Pictures as SVG and PNG in figures/, data in data/, verdicts as text in "
        "verdicts.json.",
        contents=True,
    )


def _opening(judgements: tuple[Judgement, ...], residuals: Sequence[Residual]) -> Text:
    return Text(
        (
            f"This page redoes the paper \u201c{PAPER}\u201d, on a mass "
            "that rattles in a slot of a vibrating mass: each of its figures with the same "
            "parameters, and each statement that carries a number or names a type of motion. The "
            "copy at hand names neither authors nor journal. Numbers of sections, figures and "
            "equations, as in (14), are those of this paper.",
            f"Below, {len(judgements)} claims are judged by exact computation. A printed number "
            "agrees if it is right within half a unit of its last digit; a type agrees if an "
            f"attractor of that type is found. {len(residuals)} equations are misprinted; the last "
            "but one section gives what holds. Nothing was fitted to the paper.",
        )
    )


def _differences(judgements: tuple[Judgement, ...]) -> Section:
    """Return the table of verdicts by kind of claim."""
    kinds = list(dict.fromkeys(j.claim.kind for j in judgements))

    def count(kind: str, word: Word) -> str:
        number = sum(j.claim.kind == kind and j.verdict is word for j in judgements)
        return str(number) if number else "\u2013"

    rows = [[kind.replace("_", " "), *(count(kind, word) for word in Word)] for kind in kinds]
    head = ("claim about", *(word.value for word in Word))
    return Section("Result by sort of claim", [Table(head, rows)], "summary")


# --- pictures -----------------------------------------------------------------------------------


def _mechanism(pictures: Pictures) -> list[Block]:
    return [
        Text(
            (
                "A main mass hangs on a spring and a dashpot and is shaken by a harmonic force. A "
                "free mass slides in its slot without friction. Whenever the free mass reaches a "
                "stop, A or B, both exchange momentum and lose energy.",
            )
        ),
        *pictures.figure(
            "mechanism", "The impact damper", "Not to scale. Parameters of set A.",
            "A mass on a spring and a dashpot, with a ball in a slot between stops A and B",
        ),
    ]  # fmt: skip


def _motion(pictures: Pictures) -> list[Block]:
    blocks = pictures.figure(
        "history", "Time history",
        "Set A, ω = 1.2, the stable symmetric orbit. The two stops move with the main mass; the "
        "free mass flies in straight lines between them and turns at each impact (marks).",
        "Position of both masses over time; the free mass zigzags between the two moving stops",
    )  # fmt: skip
    blocks += pictures.figure(
        "portrait", "Phase portrait",
        "Set A, ω = 1.2, started with its phase disturbed. Left: the main mass. Right: the free "
        "mass relative to the main mass, with the stops as thick lines. Dashed strokes are "
        "impacts: the velocity jumps, the place does not.",
        "Two phase portraits: velocity against position with jumps at impacts",
    )  # fmt: skip
    return blocks + pictures.figure(
        "section", "Section",
        "Set A at the frequency of Fig. 2(g): the state of the main mass just after each impact at "
        "stop A. A periodic motion would give a few dots; here the points fill a closed curve, so "
        "two frequencies without common multiple are at work.",
        "Points of a Poincare section on a closed curve",
        narrow=True,
    )  # fmt: skip


def _paths(pictures: Pictures) -> list[Block]:
    text = Text(
        (
            "A multiplier says by what factor a small disturbance has changed after one turn: "
            "inside the unit circle it dies out. The symmetric orbit repeats itself after half a "
            "period, mirrored. So the half map with multipliers ν decides, and those of the full "
            "map are their squares, λ = ν\u00b2.",
            "Where a pair crosses the circle a closed curve is born in the section. Small rings "
            "mark the strong resonances, where ν or λ is a root of one of order up to four.",
        )
    )
    same = "Colour is the frequency. The other orbit of (14) is a saddle; it is in the data."
    return [
        text,
        *pictures.figure("multipliers-A", "Multiplier paths of set A", same,
                         "Paths of the multipliers of set A around the unit circle"),
        *pictures.figure("figure-3", "Fig. 3 redone",
                         "Multiplier paths of set B (a, top) and set C (b, bottom) over the "
                         f"frequencies of the paper. {same}",
                         "Paths of the multipliers of sets B and C around the unit circle"),
    ]  # fmt: skip


def _tables(found: Findings) -> list[Block]:
    head = ("set", "ω", "sort", "sign", "ν", "ν: angle, p/q, away", "λ", "λ: angle, p/q, away",
            "|ν| with growing ω", "admissible")  # fmt: skip
    rows = [_row(name, b) for name, points in found.bifurcations.items() for b in points]
    text = Text(
        (
            "All bifurcations of both symmetric orbits in the ranges of the paper and of the "
            "diagrams below; the method proves that none is skipped. The sign is that in (14). "
            "For ν and λ: the angle, the nearest resonance p/q up to twelfths of a circle, and how "
            "far away it is, in degrees. Resonance is decided by ν. Admissible: the masses really "
            "move so.",
        )
    )
    return [text, Table(head, rows, stacked=True)]


def _row(name: str, b: Bifurcation) -> list[Cell]:
    word = {"leaves": "leaves the disc", "enters": "enters the disc"}.get(b.crossing, "\u2013")
    return [
        name, f"{b.omega:.12f}", NAMES[b.kind], f"{b.sign:+d}" if b.sign else "both",
        _complex(b.half_multiplier), _angle(b.half_angle), _complex(b.multiplier),
        _angle(b.angle), word, "yes" if b.admissible else "no",
    ]  # fmt: skip


def _angle(degrees: float) -> str:
    p, q, away = nearest_resonance(degrees)
    return f"{degrees:.3f}°, {p}/{q}, {away:.3f}°"


def _complex(z: complex) -> str:
    if abs(z.imag) < 1e-9:
        return f"{z.real:.6f}"
    return f"{z.real:.6f} \u00b1\u00a0{abs(z.imag):.6f}i"


def _panels(found: Findings, pictures: Pictures, figure: str, name: str) -> list[Block]:
    results = [r for r in found.panels.values() if r.panel.figure == figure]
    if not results:
        return [Text(("Not computed in this run.",))]
    p = found.sets[name].parameters
    text = Text(
        (
            f"Parameters: mass ratio {p.mass_ratio}, natural frequency {p.omega_n}, damping ratio "
            f"{p.zeta}, restitution {p.restitution}, half clearance {p.half_clearance}.",
            "Each panel was reached in three ways: following the attractor down along ω, back "
            "up, and from the theoretical fixed point with its phase disturbed. Different colours "
            "in one panel are different attractors at the same frequency.",
        )
    )
    head = ("panel", "ω", "start", "attractor", "decided by")
    rows: list[list[Cell]] = [row for r in results for row in _found_rows(r)]
    return [
        text,
        *pictures.figure(f"figure-{figure}", f"Fig. {figure} redone",
                         "State (place, velocity) of the main mass just after impacts at stop A.",
                         f"Sections of set {name}, one panel for each frequency"),
        Table(head, rows, caption="What was found, and the numbers that decided it."),
        *(_transient(found.transient) if found.transient and figure == PANEL[0] else []),
    ]  # fmt: skip


def _transient(found: Survivors) -> list[Block]:
    """Say how long the motion at one panel looks chaotic before it settles."""
    text = (
        f"Fig. {PANEL[0]}({PANEL[1]}) is printed as chaos, and all three motions end on a periodic "
        "one. The printed picture may be the transient before: of "
        f"{found.starts} starts on a grid, {found.left[0]} have not settled after "
        f"{found.impacts[0]} impacts, enough for a picture, and their number falls by a factor e "
        f"in about {round(found.fold, -3):.0f} impacts."
    )
    rows: list[list[Cell]] = [
        [str(a), f"{b} of {found.starts}"] for a, b in zip(found.impacts, found.left, strict=True)
    ]
    return [Text((text,)), Table(("impacts", "starts that have not settled"), rows)]


def _found_rows(result: PanelResult) -> list[list[Cell]]:
    rows: list[list[Cell]] = []
    for group in result.distinct:
        a = group[0].attractor
        starts = ", ".join(f.start for f in group)
        rows.append([result.panel.name, f"{result.omega:.10g}", starts, a.label, numbers_of(a)])
    return rows


def _diagrams(found: Findings, pictures: Pictures) -> list[Block]:
    blocks: list[Block] = [
        Text(
            (
                "At each frequency the points of the section, after settling. A single line is a "
                "1-1-1 orbit, a band a closed curve or chaos. Blue was followed down, orange up: "
                "where they part, two attractors coexist and the past decides.",
            )
        )
    ]
    for name, sweep in found.plan.sweeps.items():
        blocks += pictures.figure(
            f"diagram-{name}", f"Set {name}",
            f"ω in [{sweep.low}, {sweep.high}] in steps of {sweep.step}, and at the panels.",
            f"Bifurcation diagram of set {name} in both directions",
        )  # fmt: skip
    return blocks


# --- tables -------------------------------------------------------------------------------------


def _verdicts(judgements: tuple[Judgement, ...]) -> list[Block]:
    head = ("where", "quote", "printed", "computed", "verdict", "decided by")
    blocks: list[Block] = []
    for section, name, title in SECTIONS:
        part = [j for j in judgements if (j.claim.section, j.claim.set) == (section, name)]
        rows: list[list[Cell]] = [
            [
                ", ".join(j.claim.panels) or f"section {section}",
                f"\u201c{_readable(j.claim.quote)}\u201d",
                j.printed,
                j.result.computed,
                j.verdict.badge,
                j.result.witness,
            ]
            for j in part
        ]
        blocks.append(Table(head, rows, caption=title, stacked=True))
    return blocks


def _readable(quote: str) -> str:
    """Turn the few TeX commands in the quotes into plain signs."""
    signs = {"\\omega": "ω", "\\lambda": "λ", "\\neq": "≠", "\\rightarrow": "→", "\\pm": "±", "\\in": "∈", "$": "",
             "_{1,2}": "₁,₂", "_{3,4}": "₃,₄", "_1": "₁", "_2": "₂", "^m": "ᵐ", "^2": "²",
             "^3": "³", "^4": "⁴", "\\mu": "μ", "\\theta": "θ", "\\varphi": "φ"}  # fmt: skip
    for command, sign in signs.items():
        quote = quote.replace(command, sign)
    return quote


def _misprints(residuals: Sequence[Residual]) -> list[Block]:
    head = ("where", "printed", "holds", "why", "evaluated at", "residual", "corrected")
    rows: list[list[Cell]] = [
        [
            *(r.misprint.where, r.misprint.printed, r.misprint.corrected, r.misprint.why),
            *(r.misprint.case, f"{r.printed:.2g}", f"{r.corrected:.1g}"),
        ]
        for r in residuals
    ]
    text = Text(
        (
            "Each printed formula was put into the equation it is meant to solve; the residual is "
            "what is left. The corrected one leaves rounding only.",
        )
    )
    return [text, Table(head, rows, stacked=True)]


def _method(found: Findings) -> list[Block]:
    rows: list[list[Cell]] = [
        [key.replace("_", " "), str(value)] for key, value in found.plan.attributes().items()
    ]
    text = Text(
        (
            "Flights are exact to rounding and every first contact is proved, not sampled. Types "
            "of motion are decided by tests on the points of the section, never by eye: a periodic "
            "orbit returns; a quasiperiodic one lies on closed curves in the order of its phases; "
            "chaos has a largest Lyapunov exponent above three of its errors.",
        )
    )
    return [text, Table(("setting", "value"), rows)]
