"""Figures of results. Every function draws a given result on ``ax``, by default a new figure, and returns its Axes.

For a journal draw inside of ``with plotting.print_style(columns=1):`` (docs/pictures.md).

>>> import vibroimpact as vi
>>> from vibroimpact import plotting
>>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
...                          half_clearance=5.0, omega=1.2)
>>> ax = plotting.plot_mechanism(damper)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from vibroimpact._core.words import missing_name
from vibroimpact.plotting.along import plot_along
from vibroimpact.plotting.basins import plot_basins
from vibroimpact.plotting.bifurcation_diagram import plot_bifurcation_diagram
from vibroimpact.plotting.branch_multipliers import plot_branch_multipliers
from vibroimpact.plotting.branches import plot_branches
from vibroimpact.plotting.circles import (
    plot_circle_error,
    plot_circle_half_width,
    plot_circles,
)
from vibroimpact.plotting.curves import plot_curves, plot_tongue
from vibroimpact.plotting.design import plot_design, plot_design_map, plot_pareto_front
from vibroimpact.plotting.exponents import plot_exponents
from vibroimpact.plotting.forces import plot_forces, plot_hysteresis
from vibroimpact.plotting.history import plot_history
from vibroimpact.plotting.hybrid import plot_hybrid_run
from vibroimpact.plotting.mechanism import plot_mechanism
from vibroimpact.plotting.multipliers import plot_multipliers
from vibroimpact.plotting.orbits import plot_orbit, plot_orbits
from vibroimpact.plotting.phase_portrait import plot_phase_portrait
from vibroimpact.plotting.plane import plot_plane
from vibroimpact.plotting.response import plot_response, plot_tuned_damper
from vibroimpact.plotting.sections import plot_section
from vibroimpact.plotting.style import print_style, save
from vibroimpact.plotting.tori import plot_circle_branch, plot_invariant_circle
from vibroimpact.plotting.touches import plot_touch
from vibroimpact.plotting.transients import (
    plot_free_decay,
    plot_record,
    plot_record_response,
    plot_response_spectrum,
    plot_sine_sweep,
)

__all__ = [
    "plot_along",
    "plot_basins",
    "plot_bifurcation_diagram",
    "plot_branch_multipliers",
    "plot_branches",
    "plot_circle_branch",
    "plot_circle_error",
    "plot_circle_half_width",
    "plot_circles",
    "plot_curves",
    "plot_design",
    "plot_design_map",
    "plot_exponents",
    "plot_forces",
    "plot_free_decay",
    "plot_history",
    "plot_hybrid_run",
    "plot_hysteresis",
    "plot_invariant_circle",
    "plot_mechanism",
    "plot_multipliers",
    "plot_orbit",
    "plot_orbits",
    "plot_pareto_front",
    "plot_phase_portrait",
    "plot_plane",
    "plot_record",
    "plot_record_response",
    "plot_response",
    "plot_response_spectrum",
    "plot_section",
    "plot_sine_sweep",
    "plot_tongue",
    "plot_touch",
    "plot_tuned_damper",
    "print_style",
    "save",
]

if not TYPE_CHECKING:  # type checkers know the names

    def __getattr__(name: str) -> Any:
        """Say which name is meant by one that is not there."""
        raise missing_name(__name__, name, __all__)
