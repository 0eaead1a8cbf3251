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
not (s = 0). See theory.md, "The symmetric orbit".
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from vibroimpact._core.checks import check_kind
from vibroimpact._core.types import Complexes, Floats
from vibroimpact.compile.hybrid import Compiled, compile_mechanism
from vibroimpact.machines.impact_damper import ImpactDamper
from vibroimpact.model.state import State
from vibroimpact.simulation.simulate import Run, Status, simulate

SAME_TIME = 1e-9  # relative: two event times are one; rounding of a flight is far below
ONLY_CONTACT, STOP_A, STOP_B = 0, 1, -1


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


@dataclass(frozen=True)
class SymmetricOrbit:
    """Symmetric 1-1-1 orbit with its multipliers and residuals.

    Attributes
    ----------
    damper, sign
        The system, and the sign (+1, -1) in (14) of the paper.
    state
        State on stop A, just after the impact.
    half_multipliers
        nu_i: eigenvalues of DH, shape (4,), largest modulus first. lambda_i = nu_i^2.
    half_jacobian
        DH in section coordinates (v1+, x1, v2+, theta), shape (4, 4).
    impact_speed
        Closing speed at the impacts.
    determinant_error
        Relative error of det DH = R^2 exp(-2 pi zeta omega_n / omega), a measure of accuracy.
    admissible, inadmissible_reason
        Whether the orbit is a motion of the damper: no earlier contact, departing after each
        impact; and the reason if it is not.
    residuals
        Relative residual of each condition (11) of the paper.
    """

    damper: ImpactDamper
    sign: int
    state: State
    half_jacobian: Floats = field(repr=False)
    half_multipliers: Complexes
    impact_speed: float
    determinant_error: float
    inadmissible_reason: str
    residuals: dict[str, float] = field(repr=False)

    @property
    def multipliers(self) -> Complexes:
        """Floquet multipliers lambda = nu^2 of the full map."""
        return self.half_multipliers**2

    @property
    def jacobian(self) -> Floats:
        """DP = DH^2 in section coordinates (v1+, x1, v2+, theta)."""
        return self.half_jacobian @ self.half_jacobian

    @property
    def admissible(self) -> bool:
        """Whether the orbit is a motion of the damper."""
        return not self.inadmissible_reason

    @property
    def stable(self) -> bool:
        """Whether all multipliers are inside the unit circle, and the orbit is admissible."""
        return self.admissible and bool(np.all(np.abs(self.half_multipliers) < 1.0))

    def __repr__(self) -> str:
        nus = ", ".join(f"{nu:.6g}" for nu in self.half_multipliers)
        verdict = "stable" if self.stable else "unstable"
        reason = f", not admissible: {self.inadmissible_reason}" if self.inadmissible_reason else ""
        return (
            f"SymmetricOrbit(1-1-1, sign {self.sign:+d}, omega = {self.damper.omega}, "
            f"{verdict}{reason})\n  half multipliers {nus}\n  {self.state}"
        )


def symmetric_orbits(damper: ImpactDamper) -> tuple[SymmetricOrbit, ...]:
    """Find the symmetric 1-1-1 orbits: none, or one for each sign in (14).

    Parameters
    ----------
    damper
        The system.

    Returns
    -------
    tuple of SymmetricOrbit
        The plus sign first. Empty where (16) fails; at the fold itself both are equal.
        Orbits that are not motions of the damper are returned too, with the reason.

    Raises
    ------
    InvalidParameterError
        ``damper`` is not an ImpactDamper.

    Notes
    -----
    Cost: one 4 x 4 solve and two simulated impacts per sign, well under a millisecond.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> [orbit.stable for orbit in vi.symmetric_orbits(damper)]
    [True, False]
    """
    w, alpha, beta, compiled = on_circle(damper)
    size = math.hypot(alpha, beta)
    if size < damper.half_clearance:
        return ()
    rise = math.asin(damper.half_clearance / size)
    lead = math.atan2(beta, alpha)
    found = [
        _impact_state(damper, compiled, w, (angle - lead) % (2.0 * math.pi))
        for angle in (rise, math.pi - rise)
    ]
    found.sort(key=lambda item: -item[0])  # the larger A sin(tau_0) has the plus sign in (14)
    return (_orbit(damper, 1, found[0][1], compiled), _orbit(damper, -1, found[1][1], compiled))


def _impact_state(
    damper: ImpactDamper, compiled: Compiled, w: Floats, theta: float
) -> tuple[float, State]:
    """(A sin(tau_0), the forced part of x1 at the impact; the state there)."""
    waves = np.array([math.sin(theta), math.cos(theta)])
    x1, _, v1, v2 = (float(z) for z in w @ waves)
    free = compiled.free.to_x[0]
    response = free[-2] * float(waves[0]) + free[-1] * damper.omega * float(waves[1])
    return response, damper.on_stop("A", x1=x1, v1=v1, v2=v2, phase=theta)


def _orbit(damper: ImpactDamper, sign: int, state: State, compiled: Compiled) -> SymmetricOrbit:
    jacobian, speed = half_map_jacobian(damper, compiled, state)
    nus = np.linalg.eigvals(jacobian).astype(complex)
    nus = nus[np.lexsort((-nus.imag, -np.abs(nus).round(12)))]
    return SymmetricOrbit(
        damper=damper,
        sign=sign,
        state=state,
        half_jacobian=jacobian,
        half_multipliers=nus,
        impact_speed=speed,
        determinant_error=_determinant_error(damper, jacobian),
        inadmissible_reason=_why_inadmissible(damper, state),
        residuals=_residuals(damper, compiled, state),
    )


def half_map_jacobian(
    damper: ImpactDamper, compiled: Compiled, state: State
) -> tuple[Floats, float]:
    """DH at a symmetric orbit in (v1+, x1, v2+, theta), and the closing speed of its impacts.

    The flow over pi / omega, then the saltation of the impact: the moment of contact moves by
    dt = -du / u', and with it everything else (theory.md, "Saltation"). Valid for orbits that
    are not admissible too.
    """
    n, t, omega = 2, math.pi / damper.omega, damper.omega
    theta = state.phase
    flow = compiled.kernel.flow_matrix(t)
    tangent = np.zeros((2 * n, 4))  # d(x1, x2, v1, v2) by (v1, x1, v2, theta)
    tangent[[0, 1], 1] = 1.0
    tangent[2, 0] = tangent[3, 2] = 1.0
    arrived = flow[:, : 2 * n] @ tangent
    arrived[:, 3] += flow[:, 2 * n :] @ [math.cos(theta), -math.sin(theta)]
    start = np.concatenate([state.position, state.velocity])
    before = flow @ np.concatenate([start, [math.sin(theta), math.cos(theta)]])
    acceleration = compiled.kernel.acceleration(
        list(before[:n]), list(before[n:]), [theta + math.pi]
    )
    row = np.array(compiled.mechanism.rigid_stops[0].row)
    closing = float(row @ before[n:])
    shift = -(row @ arrived[:n]) / closing  # dt by each direction
    place = arrived[:n] + np.outer(before[n:], shift)
    speed = arrived[n:] + np.outer(acceleration, shift)
    after = compiled.kernel.impact_matrix(ONLY_CONTACT, STOP_B) @ speed
    phase = np.array([0.0, 0.0, 0.0, 1.0]) + omega * shift
    return np.stack([-after[0], -place[0], -after[1], phase]), -closing


def _determinant_error(damper: ImpactDamper, jacobian: Floats) -> float:
    decay = -2.0 * math.pi * damper.zeta * damper.omega_n / damper.omega
    expected = damper.restitution**2 * math.exp(decay)
    size = float(np.abs(np.linalg.det(jacobian) - expected))
    return size / expected if expected > 0.0 else size


def _why_inadmissible(damper: ImpactDamper, state: State) -> str:
    """Simulate half a period: the first event must be the impact at B, then."""
    gap_rate = -(state.velocity[1] - state.velocity[0])
    if gap_rate <= 0.0:
        return f"after the impact at A the masses approach at {-gap_rate:.6g}"
    half = math.pi / damper.omega
    run = simulate(damper, state, impacts=1, t_max=1.5 * half)
    if not len(run) or run.status[0] != Status.IMPACT:
        what = Status(int(run.status[0])).name.lower() if len(run) else "nothing"
        return f"the first event is {what}, not an impact at B"
    if run.stop[0] == 1 and abs(run.time[0] - half) <= SAME_TIME * half:
        return ""
    return _early(run, half)


def _early(run: Run, half: float) -> str:
    stop = "AB"[int(run.stop[0])]
    return f"contact at {stop} after t = {run.time[0]:.6g} instead of B after {half:.6g}"


def _residuals(damper: ImpactDamper, compiled: Compiled, state: State) -> dict[str, float]:
    """Each condition of (11) at the orbit, relative to its largest term."""
    n, delta = 2, damper.half_clearance
    start = np.concatenate([state.position, state.velocity])
    flow = compiled.kernel.flow_matrix(math.pi / damper.omega)
    waves = np.array([math.sin(state.phase), math.cos(state.phase)])
    before = flow @ np.concatenate([start, waves])
    jump = compiled.kernel.impact_matrix(ONLY_CONTACT, STOP_B)
    after = np.concatenate([before[:n], jump @ before[n:]])
    again = flow @ np.concatenate([after, -waves])
    names = ("x1", "x2", "v1", "v2")
    size = np.abs(start) + np.abs(before) + np.abs(after)
    out = {
        f"{k}(pi/omega) = -{k}(0)": abs(after[i] + start[i]) / size[i] for i, k in enumerate(names)
    }
    out |= {
        f"{k}(2pi/omega) before = -{k}(pi/omega) before": abs(again[i] + before[i]) / size[i]
        for i, k in enumerate(names)
    }
    for name, place, side in (("0", start, 1), ("pi/omega", before, -1), ("2pi/omega", again, 1)):
        gap = place[1] - place[0] - side * delta
        out[f"x2({name}) - x1({name}) = {side:+d} delta"] = abs(gap) / (abs(place[1]) + delta)
    return {key: float(value) for key, value in out.items()}
