"""Exact dynamics and bifurcations of vibro-impact systems."""

from __future__ import annotations

from vibroimpact._kernel import version as _version
from vibroimpact.attractors import Attractor, classify
from vibroimpact.bifurcations import Bifurcation, symmetric_bifurcations
from vibroimpact.branches import stop  # noqa: F401 - rules for stop_when
from vibroimpact.branches.branch import BifurcationPoint, Branch
from vibroimpact.branches.diagram import Diagram, branch_diagram
from vibroimpact.branches.follow import continue_orbit
from vibroimpact.branches.store import load_branch, save_branch
from vibroimpact.branches.switch import NoBranch, switch_branch
from vibroimpact.continuation import Steps
from vibroimpact.damper import ImpactDamper, Scales
from vibroimpact.derivatives import MapDerivative, map_derivative, section_jacobian
from vibroimpact.ensembles import kinds as observe  # noqa: F401 - observers with their options
from vibroimpact.ensembles.again import sweep_again
from vibroimpact.ensembles.basins import attractor_state, basins
from vibroimpact.ensembles.diagram import bifurcation_sweep
from vibroimpact.ensembles.listed_starts import ListedStarts
from vibroimpact.ensembles.plane import multistability, plane
from vibroimpact.ensembles.starts import GridStarts, RandomStarts
from vibroimpact.ensembles.sweep import sweep
from vibroimpact.errors import (
    BackendUnavailableError,
    ClusterLostError,
    InvalidParameterError,
    StoreError,
    VibroImpactError,
)
from vibroimpact.following import follow
from vibroimpact.iterates import Kind, Shape, classify_points
from vibroimpact.lyapunov import LyapunovEstimate, lyapunov_exponent
from vibroimpact.mechanism import Contact, Harmonic, Mechanism
from vibroimpact.normal_forms import ExplicitMap, normal_form
from vibroimpact.orbits import SymmetricOrbit, symmetric_orbits
from vibroimpact.parameters import Family
from vibroimpact.periodic.find import Guess, find_orbit
from vibroimpact.periodic.found import OrbitSearch
from vibroimpact.periodic.maps import full_map, half_map, impact_map, stroboscopic_map
from vibroimpact.periodic.orbit import Orbit
from vibroimpact.periodic.search import find_orbits
from vibroimpact.sections import (
    Section,
    StroboscopicSection,
    impact_section,
    stroboscopic_section,
)
from vibroimpact.simulate import Run, RunEnd, Status, simulate
from vibroimpact.state import State

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
