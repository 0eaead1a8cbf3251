"""Free flight by one matrix exponential at 50 digits: z' = B z, z = (x, v, sin, cos, ..., 1)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from witness.precision import exact, mp

if TYPE_CHECKING:
    import vibroimpact as vi


def generator(m: vi.Mechanism) -> Any:
    """B of a mechanism, forces and the constant included."""
    n, lines = m.degrees, len(m.forces)
    inverse = mp.matrix([[exact(x) for x in row] for row in m.mass]) ** -1
    size = 2 * n + 2 * lines + 1
    pull = mp.zeros(n, size)  # f - C v - K x on z
    for i in range(n):
        for j in range(n):
            pull[i, j] = -exact(m.stiffness[i][j])
            pull[i, n + j] = -exact(m.damping[i][j])
        for k, force in enumerate(m.forces):
            pull[i, 2 * n + 2 * k] = exact(force.sine[i])
            pull[i, 2 * n + 2 * k + 1] = exact(force.cosine[i])
        pull[i, size - 1] = exact(m.constant_force[i])
    drift = inverse * pull
    B = mp.zeros(size)
    for i in range(n):
        B[i, n + i] = 1
        for j in range(size):
            B[n + i, j] = drift[i, j]
    for k, force in enumerate(m.forces):
        at = 2 * n + 2 * k
        B[at, at + 1], B[at + 1, at] = exact(force.omega), -exact(force.omega)
    return B


def flown(m: vi.Mechanism, state: vi.State, t: float) -> tuple[list[Any], list[Any]]:
    """Position and velocity a time t later."""
    n = m.degrees
    z = [exact(x) for x in (*state.position, *state.velocity)]
    for force in m.forces:
        phase = exact(state.phase) * exact(force.omega) / exact(m.omega)
        z += [mp.sin(phase), mp.cos(phase)]
    out = mp.expm(generator(m) * exact(t)) * mp.matrix([*z, 1])
    return [out[i] for i in range(n)], [out[n + i] for i in range(n)]
