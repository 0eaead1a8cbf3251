"""Symmetric 1-1-1 orbits of the impact damper, in closed form.

The half map H takes a state just after an impact at stop A to the one just after the next impact,
at stop B, and applies the symmetry (x, v, theta) -> (-x, -v, theta + pi). A symmetric 1-1-1
orbit is a fixed point of H with flight time pi / omega. With Phi, Gamma the flow over half a
period and J the impact,

    w = -J (Phi w + Gamma (sin theta, cos theta))    =>    w = W (sin theta, cos theta)      (1)

is linear in (sin theta, cos theta), and the state is on stop A where

    u = alpha sin theta + beta cos theta = half_clearance,                                   (2)

which has two solutions where alpha^2 + beta^2 > half_clearance^2, none where it is less: the two
signs of (14) and the condition (16) of the paper. (1) is regular where the paper's constants are
not (s = 0). See theory.md, "The symmetric orbit". Newton's method has no part in it, so the
residual of the equations of orbits at these states is a check of both.
"""

from __future__ import annotations

import math

import numpy as np

from vibroimpact._core.checks import check_kind
from vibroimpact._core.types import Floats
from vibroimpact.compile.hybrid import Compiled, compile_mechanism
from vibroimpact.machines.impact_damper import ImpactDamper
from vibroimpact.model.state import State
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System
from vibroimpact.orbits.newton import residual_of
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.problem import OrbitProblem, Signature

ONLY_CONTACT, STOP_B = 0, -1
SIGNATURE = Signature((Stop(0, 1), Stop(0, -1)), 1, True)


def has_symmetric_orbits(machine: type) -> bool:
    """Whether closed forms of symmetric orbits are known for a class of systems."""
    return issubclass(machine, ImpactDamper)


def known_orbits(system: System) -> tuple[Orbit, ...]:
    """Symmetric orbits in closed form; empty where none exist or none are known."""
    return symmetric_orbits(system) if isinstance(system, ImpactDamper) else ()


def symmetric_orbits(system: ImpactDamper) -> tuple[Orbit, ...]:
    """Find the symmetric 1-1-1 orbits: none, or one for each sign in (14).

    Parameters
    ----------
    system
        The system.

    Returns
    -------
    tuple of Orbit
        The plus sign first. Empty where (16) fails; at the fold itself both are equal.
        Orbits that are not motions of the damper are returned too, with the reason.

    Raises
    ------
    InvalidParameterError
        ``system`` is not an ImpactDamper.

    Notes
    -----
    Cost: some 3 ms, most of it the residuals of the equations of orbits.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> [orbit.stable for orbit in vi.symmetric_orbits(damper)]
    [True, False]
    """
    w, alpha, beta, compiled = on_circle(system)
    size = math.hypot(alpha, beta)
    if size < system.half_clearance:
        return ()
    rise = math.asin(system.half_clearance / size)
    lead = math.atan2(beta, alpha)
    found = [
        _impact_state(system, compiled, w, (angle - lead) % (2.0 * math.pi))
        for angle in (rise, math.pi - rise)
    ]
    found.sort(key=lambda item: -item[0])  # the larger A sin(tau_0) has the plus sign in (14)
    problem = OrbitProblem(system, SIGNATURE, "")  # of both
    return tuple(_orbit(problem, state) for _, state in found)


def on_circle(damper: ImpactDamper) -> tuple[Floats, float, float, Compiled]:
    """(W, alpha, beta, compiled) of (1) and (2)."""
    check_kind("damper", damper, ImpactDamper, "an ImpactDamper")
    compiled = compile_mechanism(damper.mechanism)
    n = compiled.mechanism.degrees
    flow = compiled.kernel.flow_matrix(math.pi / damper.omega)
    phi, gamma = flow[:, : 2 * n], flow[:, 2 * n :]
    jump = np.eye(2 * n)
    jump[n:, n:] = compiled.kernel.impact_matrix(ONLY_CONTACT, STOP_B)
    w: Floats = np.asarray(np.linalg.solve(np.eye(2 * n) + jump @ phi, -jump @ gamma), np.float64)
    alpha, beta = np.array(compiled.mechanism.rigid_stops[0].row) @ w[:n]
    return w, float(alpha), float(beta), compiled


def _impact_state(
    damper: ImpactDamper, compiled: Compiled, w: Floats, theta: float
) -> tuple[float, State]:
    """(A sin(tau_0), the forced part of x1 at the impact; the state there)."""
    waves = np.array([math.sin(theta), math.cos(theta)])
    x1, _, v1, v2 = (float(z) for z in w @ waves)
    free = compiled.free.to_x[0]
    response = free[-2] * float(waves[0]) + free[-1] * damper.omega * float(waves[1])
    return response, damper.on_stop("A", x1=x1, v1=v1, v2=v2, phase=theta)


def _orbit(problem: OrbitProblem, state: State) -> Orbit:
    states = np.array([[*state.position, *state.velocity, state.phase]])
    durations = np.array([math.pi / problem.mechanism.omega])
    residual = residual_of(problem, problem.packed(states, durations))
    return Orbit(problem.system, SIGNATURE, states, durations, residual, solved=problem)
