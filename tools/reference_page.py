"""Write docs/reference.md from the docstrings of the package.

python tools/reference_page.py            write the page
python tools/reference_page.py --check    exit 1 if the page is not what would be written
"""

from __future__ import annotations

import enum
import inspect
import re
import sys
import textwrap
from operator import attrgetter
from pathlib import Path
from typing import Any

import vibroimpact as vi
from vibroimpact import plotting

PAGE = Path(__file__).resolve().parents[1] / "docs" / "reference.md"
GROUPS = {
    "Systems": [
        *("ImpactDamper", "ImpactOscillator"),
        *("Mechanism", "Structure", "RigidStop", "RigidStopState", "SoftStop", "SoftStopState"),
        *("Friction", "FrictionState", "NormalLoad", "PhaseSwitch", "PhaseSwitchState"),
        *("Harmonic", "State", "HybridSystem", "LinearMode", "LinearGuard", "Transition"),
    ],
    "Simulation": ["simulate", "Run", "RunEnd", "Status", "simulate_hybrid", "HybridRun"],
    "Sections and following": [
        *(
            "section",
            "Section",
            "AtStop",
            "AtPhase",
            "AtChange",
        ),
    ],
    "Symmetric orbits and bifurcations": [
        "symmetric_orbits",
    ],
    "Periodic orbits": [
        *("find_orbit", "find_orbits", "Orbit", "OrbitSearch", "Guess", "Family"),
    ],
    "Branches": [
        *("continue_orbit", "switch_branch", "branch_diagram", "Branch", "BifurcationPoint"),
        *("NotFound", "Diagram", "Steps", "stop.inadmissible", "stop.unstable"),
        *("save", "load", "load_machine", "load_start", "Result", "ProgressReport"),
    ],
    "Curves in two parameters": [
        *("continue_bifurcation", "continue_level", "BifurcationCurve"),
        *("switch_curve", "GrazingContact", "tongue", "Tongue"),
        *("bifurcation_atlas", "Atlas"),
        *("map_bifurcation",),
    ],
    "Invariant circles": [
        *(
            "find_circle",
            "continue_circle",
            "switch_circle",
            "Circle",
            "CircleBranch",
        ),
        "CircleGuess",
    ],
    "Maps and normal forms": [
        *("full_map", "half_map", "impact_map", "stroboscopic_map"),
        *("normal_form", "ExplicitMap"),
    ],
    "Attractors": [
        *("classify", "Attractor", "classify_points", "InvariantSet", "Kind"),
        *("lyapunov_exponent", "LyapunovEstimate", "lyapunov_spectrum", "LyapunovSpectrum"),
    ],
    "Ensembles": [
        *("sweep", "RandomStarts", "GridStarts", "ListedStarts", "plane", "bifurcation_sweep"),
        *("basins", "attractor_state", "multistability", "rerun_sweep"),
    ],
    "Design": [
        *("frequency_response", "Response", "Answer", "ResponseCurve", "measure_of", "Measure"),
        *(f"measures.{name}" for name in ("Amplitude", "Peak", "Rms", "Harmonic")),
        *(f"measures.{name}" for name in ("Transmissibility", "DissipatedPower", "ContactForce")),
        *(f"measures.{name}" for name in ("Impulse", "ImpactSpeed", "ImpactRate")),
        *("Objective", "optimise", "Design"),
        *("design_map", "DesignMap", "pareto_front", "ParetoFront"),
        *("tuned_damper", "TunedDamper"),
    ],
    "Transients": [
        *("free_decay", "FreeDecay", "sine_sweep", "SineSweep"),
        *("ForceRecord", "simulate_record", "RecordResponse", "Energies"),
        *("response_spectrum", "ResponseSpectrum"),
    ],
    "Derivatives": ["map_derivative", "MapDerivative"],
    "Errors": [
        *("VibroImpactError", "InvalidParameterError", "StoreError", "ClusterLostError"),
        "BackendUnavailableError",
    ],
}
HEAD = """# Reference

Written by `tools/reference_page.py` from the docstrings. `import vibroimpact as vi`; everything
below is public, other names are not. Pictures: `from vibroimpact import plotting`; every function
draws on `ax`, by default a new figure, and returns its Axes.

**Units.** Arguments and results are in the units of the machine, any consistent ones: SI for a
machine of `from_physical`, whose labels name them. Angles are radians unless a name says degrees.

**Conventions.** Contact coordinate u = row . x; stop A is the upper one, stop B the lower one; for
the damper u = x2 - x1, and stop A is u = +half_clearance. A gap is >= 0 where the mechanism may be.
Phase is the phase theta of the force sin(theta), in [0, 2 pi). Arrays of results are read-only.
n is the number of coordinates."""
PICTURES = """## Pictures

Every function takes a result, runs nothing, draws on `ax` or on a new figure, and returns the
matplotlib `Axes`. Nothing is shown and no setting of matplotlib is changed."""

Sections = dict[str, str]


def plain(text: str) -> str:
    """Docstring markup as Markdown."""
    text = re.sub(r":\w+:`~?([^`]*)`", lambda m: f"`{m[1].split('.')[-1]}`", text)
    return text.replace("``", "`")


def wrapped(text: str) -> str:
    """Paragraphs of at most 110 characters a line."""
    parts = (" ".join(part.split()) for part in plain(text).split("\n\n"))
    return "\n\n".join(textwrap.fill(part, 110) for part in parts)


def split(thing: Any) -> tuple[str, Sections]:
    """The text of a docstring, and its numpydoc sections."""
    head, *rest = re.split(r"^(\w[\w ]*)\n-+\n", inspect.getdoc(thing) or "", flags=re.MULTILINE)
    return head.strip(), {k: v.strip("\n") for k, v in zip(rest[::2], rest[1::2], strict=True)}


def entries(section: str) -> list[tuple[str, str]]:
    """(name, text) of the entries of a numpydoc section."""
    found: list[list[str]] = []
    for line in section.splitlines():
        if line and not line.startswith(" "):
            found.append([line.partition(" : ")[0], ""])
        elif found:
            found[-1][1] = f"{found[-1][1]} {line.strip()}".strip()
    return [(name, plain(text)) for name, text in found]


def listed(title: str, rows: list[tuple[str, str]]) -> list[str]:
    """A list of names with their texts, or nothing."""
    if not rows:
        return []
    items = (f"- `{name}`: {text}" if text else f"- `{name}`" for name, text in rows)
    return ["", f"*{title}*", "", *(textwrap.fill(x, 110, subsequent_indent="  ") for x in items)]


def signature(thing: Any) -> str:
    """Parameters of a function with their defaults; nothing for a class."""
    if isinstance(thing, type):
        return ""
    whole = inspect.signature(thing)
    bare = [p.replace(annotation=inspect.Parameter.empty) for p in whole.parameters.values()]
    return str(whole.replace(parameters=bare, return_annotation=inspect.Signature.empty))


def members(cls: type, named: str) -> list[tuple[str, str]]:
    """Properties and methods, inherited ones too, that the docstring does not name."""
    found = []
    ours = [base for base in cls.__mro__ if base.__module__.startswith(vi.__name__)]
    every = {name: member for base in reversed(ours) for name, member in vars(base).items()}
    for name, member in every.items():
        inner = getattr(member, "__func__", getattr(member, "fget", member))
        if (
            name.startswith("_")
            or not inspect.isfunction(inner)
            or re.search(rf"\b{name}\b", named)
        ):
            continue
        called = [p for p in inspect.signature(inner).parameters if p not in ("self", "cls")]
        call = "" if isinstance(member, property) else f"({', '.join(called)})"
        found.append((name + call, plain(split(inner)[0].splitlines()[0])))
    return found


def values(cls: type[enum.Enum]) -> list[tuple[str, str]]:
    """Members of an enumeration with the comment or the sentence that explains them."""
    comments = dict(
        re.findall(r"^    (\w+) = [^#\n]*#: (.*)$", inspect.getsource(cls), re.MULTILINE)
    )
    return [(v.name, getattr(v, "sentence", "") or comments.get(v.name, "")) for v in cls]


def described(prefix: str, name: str, thing: Any) -> list[str]:
    """The part of the page on one public name."""
    head, sections = split(thing)
    call = f"{prefix}.{name}{signature(thing)}"
    lines = ["", f"### `{call}`" if len(call) < 110 else f"### `{prefix}.{name}`", ""]
    if len(call) >= 110:
        lines += ["```text", textwrap.fill(call, 110, subsequent_indent="    "), "```", ""]
    lines += [wrapped(head)]
    for title in ("Parameters", "Attributes"):
        lines += listed(title, entries(sections.get(title, "")))
    if isinstance(thing, enum.EnumMeta):
        return lines + listed("Values", values(thing))
    if isinstance(thing, type):
        named = "".join(
            n for t in ("Parameters", "Attributes") for n, _ in entries(sections.get(t, ""))
        )
        lines += [] if issubclass(thing, Exception) else listed("Also", members(thing, named))
    elif "Returns" in sections:
        lines += ["", wrapped("Returns " + sections["Returns"].replace("\n", ". ", 1))]
    if "Raises" in sections and not isinstance(thing, type):
        errors = "; ".join(f"`{n}`: {t}" for n, t in entries(sections["Raises"]))
        lines += ["", textwrap.fill(f"Raises {errors}", 110)]
    if "Notes" in sections:
        lines += ["", wrapped(sections["Notes"])]
    return lines


def page() -> str:
    """The whole page."""
    lines = [HEAD]
    for title, names in GROUPS.items():
        lines += ["", f"## {title}"]
        for name in names:
            lines += described("vi", name, attrgetter(name)(vi))
    lines += ["", PICTURES]
    for name in plotting.__all__:
        lines += described("plotting", name, getattr(plotting, name))
    return "\n".join(lines).rstrip() + "\n"


def main(arguments: list[str]) -> int:
    """Write or check the page."""
    if arguments == ["--check"]:
        return int(PAGE.read_text() != page())
    PAGE.write_text(page())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
