"""Exact dynamics and bifurcations of vibro-impact systems."""

from __future__ import annotations

from vibroimpact._kernel import version as _version
from vibroimpact.attractors import Attractor, classify
from vibroimpact.bifurcations import Bifurcation, symmetric_bifurcations
from vibroimpact.damper import ImpactDamper, Scales
from vibroimpact.derivatives import MapDerivative, map_derivative, section_jacobian
from vibroimpact.errors import InvalidParameterError, VibroImpactError
from vibroimpact.following import follow
from vibroimpact.iterates import Kind, Shape, classify_points
from vibroimpact.lyapunov import LyapunovEstimate, lyapunov_exponent
from vibroimpact.mechanism import Contact, Harmonic, Mechanism
from vibroimpact.orbits import SymmetricOrbit, symmetric_orbits
from vibroimpact.sections import Section, impact_section
from vibroimpact.simulate import Run, RunEnd, Status, simulate
from vibroimpact.state import State

__version__ = _version()

__all__ = [
    "Attractor",
    "Bifurcation",
    "Contact",
    "Harmonic",
    "ImpactDamper",
    "InvalidParameterError",
    "Kind",
    "LyapunovEstimate",
    "MapDerivative",
    "Mechanism",
    "Run",
    "RunEnd",
    "Scales",
    "Section",
    "Shape",
    "State",
    "Status",
    "SymmetricOrbit",
    "VibroImpactError",
    "classify",
    "classify_points",
    "follow",
    "impact_section",
    "lyapunov_exponent",
    "map_derivative",
    "section_jacobian",
    "simulate",
    "symmetric_bifurcations",
    "symmetric_orbits",
]
