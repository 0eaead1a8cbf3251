"""Exact dynamics and bifurcations of vibro-impact systems."""

from __future__ import annotations

from vibroimpact._core.errors import (
    BackendUnavailableError,
    ClusterLostError,
    InvalidParameterError,
    StoreError,
    VibroImpactError,
)
from vibroimpact._kernel import version as _version
from vibroimpact.attractors.classify import Attractor, classify
from vibroimpact.attractors.point_sets import Kind, Shape, classify_points
from vibroimpact.attractors.sweep_attractor import follow
from vibroimpact.branches import stop_rules as stop  # noqa: F401 - rules for stop_when
from vibroimpact.branches.branch import BifurcationPoint, Branch
from vibroimpact.branches.continue_orbit import continue_orbit
from vibroimpact.branches.diagram import Diagram, branch_diagram
from vibroimpact.branches.store import load_branch, save_branch
from vibroimpact.branches.switch import NoBranch, switch_branch
from vibroimpact.closed_forms.bifurcations import Bifurcation, symmetric_bifurcations
from vibroimpact.closed_forms.symmetric_orbits import SymmetricOrbit, symmetric_orbits
from vibroimpact.continuation import Steps
from vibroimpact.machines.impact_damper import ImpactDamper, Scales
from vibroimpact.model.mechanism import Contact, Harmonic, Mechanism
from vibroimpact.model.parameters import Family
from vibroimpact.model.state import State
from vibroimpact.normal_forms import ExplicitMap, normal_form
from vibroimpact.orbits.find import Guess, find_orbit
from vibroimpact.orbits.maps import full_map, half_map, impact_map, stroboscopic_map
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.search import find_orbits
from vibroimpact.orbits.search_result import OrbitSearch
from vibroimpact.simulation.derivatives import MapDerivative, map_derivative, section_jacobian
from vibroimpact.simulation.lyapunov import LyapunovEstimate, lyapunov_exponent
from vibroimpact.simulation.sections import (
    Section,
    StroboscopicSection,
    impact_section,
    stroboscopic_section,
)
from vibroimpact.simulation.simulate import Run, RunEnd, Status, simulate
from vibroimpact.sweeps.analyses.basins import attractor_state, basins
from vibroimpact.sweeps.analyses.diagram import bifurcation_sweep
from vibroimpact.sweeps.analyses.plane import multistability, plane
from vibroimpact.sweeps.listed_starts import ListedStarts
from vibroimpact.sweeps.observers import kinds as observe  # noqa: F401 - observers with their options
from vibroimpact.sweeps.rerun import sweep_again
from vibroimpact.sweeps.starts import GridStarts, RandomStarts
from vibroimpact.sweeps.sweep import sweep

__version__ = _version()

__all__ = [
    "Attractor",
    "BackendUnavailableError",
    "Bifurcation",
    "BifurcationPoint",
    "Branch",
    "ClusterLostError",
    "Contact",
    "Diagram",
    "ExplicitMap",
    "Family",
    "GridStarts",
    "Guess",
    "Harmonic",
    "ImpactDamper",
    "InvalidParameterError",
    "Kind",
    "ListedStarts",
    "LyapunovEstimate",
    "MapDerivative",
    "Mechanism",
    "NoBranch",
    "Orbit",
    "OrbitSearch",
    "RandomStarts",
    "Run",
    "RunEnd",
    "Scales",
    "Section",
    "Shape",
    "State",
    "Status",
    "Steps",
    "StoreError",
    "StroboscopicSection",
    "SymmetricOrbit",
    "VibroImpactError",
    "attractor_state",
    "basins",
    "bifurcation_sweep",
    "branch_diagram",
    "classify",
    "classify_points",
    "continue_orbit",
    "find_orbit",
    "find_orbits",
    "follow",
    "full_map",
    "half_map",
    "impact_map",
    "impact_section",
    "load_branch",
    "lyapunov_exponent",
    "map_derivative",
    "multistability",
    "normal_form",
    "plane",
    "save_branch",
    "section_jacobian",
    "simulate",
    "stroboscopic_map",
    "stroboscopic_section",
    "sweep",
    "sweep_again",
    "switch_branch",
    "symmetric_bifurcations",
    "symmetric_orbits",
]
