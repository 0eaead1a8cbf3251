"""Table of the functions that draw results, behind ``result.plot()``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from matplotlib.axes import Axes

from vibroimpact.attractors.classify import Attractor
from vibroimpact.bifurcations.atlas import Atlas
from vibroimpact.bifurcations.curve import BifurcationCurve
from vibroimpact.bifurcations.tongue import Tongue
from vibroimpact.branches.branch import Branch
from vibroimpact.branches.diagram import Diagram
from vibroimpact.design.maps import DesignMap
from vibroimpact.design.optimise import Design
from vibroimpact.design.pareto import ParetoFront
from vibroimpact.normal_forms.touch import Touch
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.problem import least_cycles, oddness
from vibroimpact.orbits.search_result import OrbitSearch
from vibroimpact.plotting.branches import plot_branches
from vibroimpact.plotting.curves import plot_curves, plot_tongue
from vibroimpact.plotting.design import plot_design, plot_design_map, plot_pareto_front
from vibroimpact.plotting.exponents import plot_exponents
from vibroimpact.plotting.history import plot_history
from vibroimpact.plotting.hybrid import plot_hybrid_run
from vibroimpact.plotting.orbits import plot_orbit, plot_orbits
from vibroimpact.plotting.response import plot_response, plot_tuned_damper
from vibroimpact.plotting.sections import plot_section
from vibroimpact.plotting.tori import plot_circle_branch, plot_invariant_circle
from vibroimpact.plotting.touches import plot_touch
from vibroimpact.plotting.transients import (
    plot_free_decay,
    plot_record,
    plot_record_response,
    plot_response_spectrum,
    plot_sine_sweep,
)
from vibroimpact.response.response import Response
from vibroimpact.response.tuned import TunedDamper
from vibroimpact.simulation.hybrid_run import HybridRun
from vibroimpact.simulation.lyapunov import LyapunovEstimate
from vibroimpact.simulation.lyapunov_spectrum import LyapunovSpectrum
from vibroimpact.simulation.sections import Section
from vibroimpact.simulation.simulate import Run
from vibroimpact.tori.branch import CircleBranch
from vibroimpact.tori.circle import Circle
from vibroimpact.transients.force_record import ForceRecord
from vibroimpact.transients.free_decay import FreeDecay
from vibroimpact.transients.record_response import RecordResponse
from vibroimpact.transients.response_spectrum import ResponseSpectrum
from vibroimpact.transients.sine_sweep import SineSweep


def _diagram(diagram: Diagram, variable: str = "v1", **options: Any) -> Axes:
    """Draw all branches and their mirror images over the attractors, after the impacts at the stop of the sweep."""
    family, points = diagram.branches[0].family, diagram.attractors
    return plot_branches(
        diagram.branches,
        variable=variable,
        stop=family.signature.impacts[0],
        mirror=not oddness(family.mechanism, least_cycles(family.mechanism)),
        attractors=points if points is not None and str(variable) in points else None,
        bounds=diagram.bounds,
        **options,
    )


def _branch(branch: Branch, variable: str = "v1", **options: Any) -> Axes:
    return plot_branches([branch, *branch.others], variable=variable, **options)


def _curve(curve: BifurcationCurve, **options: Any) -> Axes:
    return plot_curves([curve], **options)


def _atlas(atlas: Atlas, **options: Any) -> Axes:
    return plot_curves(atlas.curves, **{"bounds": atlas.bounds} | options)


def _attractor(attractor: Attractor, **options: Any) -> Axes:
    return plot_section(attractor.section, **options)


DRAWINGS: dict[type, Callable[..., Axes]] = {
    Atlas: _atlas,
    Attractor: _attractor,
    BifurcationCurve: _curve,
    Branch: _branch,
    Circle: plot_invariant_circle,
    CircleBranch: plot_circle_branch,
    Design: plot_design,
    DesignMap: plot_design_map,
    Diagram: _diagram,
    ForceRecord: plot_record,
    FreeDecay: plot_free_decay,
    HybridRun: plot_hybrid_run,
    LyapunovEstimate: plot_exponents,
    LyapunovSpectrum: plot_exponents,
    Orbit: plot_orbit,
    OrbitSearch: plot_orbits,
    ParetoFront: plot_pareto_front,
    RecordResponse: plot_record_response,
    Response: plot_response,
    ResponseSpectrum: plot_response_spectrum,
    Run: plot_history,
    Section: plot_section,
    SineSweep: plot_sine_sweep,
    Tongue: plot_tongue,
    Touch: plot_touch,
    TunedDamper: plot_tuned_damper,
}


def drawing_of(kind: type) -> Callable[..., Axes]:
    """Function that draws the results of a class, or of the class that it inherits."""
    return next(DRAWINGS[one] for one in kind.__mro__ if one in DRAWINGS)
