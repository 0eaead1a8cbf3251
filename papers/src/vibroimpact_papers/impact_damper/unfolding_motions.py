"""Motions of the damper on the centre manifold of a strong resonance, in the coordinate of its flow.

Equation    displacements x of the state after an impact from the fixed point, (x1, v1, v2, phase),
            in the frame of stop A; at 1:4 and 1:3 the manifold to second order is that of the
            normal form. At 1:2 and 1:1 w0 and its rate are read from four successive iterates of
            H, -H or H being near the identity: with y_k = (+-1)^k <f, x_k>,
                w0 = (y_0 + 3 y_1 + 3 y_2 + y_3) / 8,    w' = (y_3 + y_2 - y_1 - y_0) / 4        (1)
            in which the second order of x in w0 cancels at 1:2; <f, q0> = 1, <f, q1> = 0, and
            <f, v> = 0 for the other eigenvectors v of the fixed point
Method      a motion that starts beside the manifold tends to it where all other multipliers lie
            inside the unit circle. If one, nu, lies outside, with left and right eigenvectors l
            and v, <l, v> = 1, the motion is steered: from time to time x is changed by
                -<l, x_n> / nu^n v                                                               (2)
            with its n-th iterate x_n, for increasing n: what is left is of order |x|^2 / nu^n. The
            factor nu^n of the motion itself is measured from one n to the next
Assumes     at 1:2 and 1:1 at most one other multiplier outside the unit circle
Fails       a motion ends, as NaN, where it leaves, or an event is no simple impact
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.machines.impact_damper import ImpactDamper
from vibroimpact.model.state import State
from vibroimpact.normal_forms import CodimensionTwo, on_pair_manifold
from vibroimpact.simulation.simulate import Status
from vibroimpact.simulation.simulator import Simulator
from vibroimpact_papers.impact_damper.unfolding_flows import DoubleFlow, solved

STRIDE, AHEAD = 4, 32  # n of (2): every so-many-th up to the largest
BLOCK = 16  # iterates between changes (2)
START = 1e-2  # change of a start at which it is good enough, in units of the flow
DIFFERENCE = 0.01  # of starts, in these units
NEARER = (0.5, 1.0)  # of a start: what the second order of the manifold changes is extrapolated


@dataclass(frozen=True, eq=False)
class HalfMap:
    """Half map near a fixed point.

    Attributes
    ----------
    damper
        The damper.
    middle
        (x1, v1, v2, phase) at the displacement zero, shape (4,).
    jacobian
        Its derivative at the fixed point, shape (4, 4).
    """

    damper: ImpactDamper
    middle: Floats = field(repr=False)
    jacobian: Floats = field(repr=False)

    @classmethod
    def at(cls, damper: ImpactDamper, state: State, jacobian: Floats) -> HalfMap:
        """Return H at a symmetric orbit, with its derivative by (v1, x1, v2, phase)."""
        middle = np.array([state.position[0], *state.velocity, state.phase])
        order = [1, 0, 2, 3]
        return cls(damper, middle, jacobian[np.ix_(order, order)])

    def state(self, x: Floats) -> State:
        """Return the state at a displacement."""
        x1, v1, v2, phase = map(float, self.middle + x)
        return self.damper.on_stop("A", x1=x1, v1=v1, v2=v2, phase=phase % (2.0 * math.pi))

    def begin(self, x: Floats) -> Simulator:
        """Return the motion that starts at a displacement."""
        return Simulator(self.damper, self.state(x))

    def iterates(self, motion: Simulator, count: int) -> Floats:
        """Return the next displacements, shape (count, 4); fewer where one is no simple impact."""
        part = motion.events(count)
        x = np.empty((len(part["status"]), 4))
        x[:, 0], x[:, 1:3] = part["after"][:, 0], part["after"][:, 2:4]
        x[:, :3] *= part["side"][:, None]
        x[:, 3] = part["phase"][:, 0] + np.where(part["side"] > 0, 0.0, math.pi)
        x -= self.middle
        x[:, 3] = np.remainder(x[:, 3] + math.pi, 2.0 * math.pi) - math.pi
        other = part["status"] != Status.IMPACT
        return x[: np.argmax(other)] if other.any() else x


def iterated(
    form: CodimensionTwo, half: HalfMap, z: complex, every: int, count: int, limit: float
) -> Complexes:
    """Return z of every so-many-th iterate from a start on the centre manifold; they end beyond a limit of |z|."""
    kept = half.iterates(
        half.begin(on_pair_manifold(np.array([z]), form.q, form.h20, form.h11)[0]),
        every * (count - 1),
    )
    return ended(np.append(z, coordinate_of(form, kept[every - 1 :: every])), count, limit)


def ended(z: Complexes, count: int, limit: float) -> Complexes:
    """Return so many points, NaN where there are none and beyond the first that exceeds the limit."""
    padded = np.full(count, np.nan + 0j)
    gone = np.flatnonzero(np.abs(z) > limit)
    kept = z[: gone[0] if gone.size else count]
    padded[: len(kept)] = kept
    return padded


def coordinate_of(form: CodimensionTwo, x: Floats) -> Complexes:
    """Return z of displacements from the fixed point."""
    linear: Complexes = x @ form.p.conj()
    z = linear
    for _ in range(4):
        bent = np.real(np.outer(z**2, form.h20)) + np.outer(np.abs(z) ** 2, form.h11)
        z = linear - bent @ form.p.conj()
    return z


# --- 1:2 and 1:1 ----------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class OnManifold:
    """Motions on the centre manifold at 1:2 or 1:1."""

    flow: DoubleFlow
    half: HalfMap
    reader: Floats = field(repr=False)  # f of (1)
    outer: float  # nu of (2), the largest of the other multipliers
    left: Floats = field(repr=False)
    right: Floats = field(repr=False)

    @classmethod
    def of(cls, flow: DoubleFlow, half: HalfMap) -> OnManifold:
        """Return it with the eigenvectors of the fixed point."""
        nus, right = np.linalg.eig(half.jacobian)
        others = np.argsort(np.abs(nus - flow.root))[2:]
        basis = np.column_stack([flow.form.q0, flow.form.q1, right[:, others]])
        reader = np.linalg.solve(basis.T, [1.0, 0.0, 0.0, 0.0]).real
        out = others[np.argmax(np.abs(nus[others]))]
        left = np.linalg.inv(right)[out].real
        return cls(flow, half, reader, float(nus[out].real), left, right[:, out].real)

    def followed(self, z: complex, every: int, count: int, limit: float) -> Complexes:
        """Return z of every so-many-th iterate from a start; they end beyond a limit of |z|."""
        flow = self.flow

        def start(aim: Floats) -> Floats:
            w, rate = flow.amplitude * aim / [1.0, flow.iterates]
            return np.asarray(w * flow.form.q0 + flow.root.real * rate * flow.form.q1)

        def read(aim: Floats) -> complex:
            return complex(ended(self._read(start(aim), every, 1, limit), 1, math.inf)[0])

        bent = np.zeros(2)
        for share in NEARER:
            wanted = share * np.array([z.real, z.imag])
            step, near = np.full(2, DIFFERENCE), np.full(2, START)
            aim = solved(read, share * z, wanted + 4.0 * bent, step, near)
            bent = aim - wanted
        if not np.isfinite(aim).all():
            return np.full(count, np.nan + 0j)
        return ended(self._read(start(aim), every, count, limit), count, limit)

    def _read(self, x: Floats, every: int, count: int, limit: float) -> Complexes:
        """Return (1) as z along the motion from a displacement, once it has settled."""
        flow = self.flow
        far = limit * flow.amplitude
        steered = abs(self.outer) > 1.0
        parts = self._steered(x, every, count, far) if steered else self._free(x, every, count)
        y = parts * flow.root.real ** np.arange(1, 5)
        w, rate = y @ [0.125, 0.375, 0.375, 0.125], y @ [-0.25, -0.25, 0.25, 0.25]
        found: Complexes = (w + 1j * rate * flow.iterates) / flow.amplitude
        return found

    def _free(self, x: Floats, every: int, count: int) -> Floats:
        """Return <f, x> of four iterates again and again, shape (at most count, 4)."""
        motion = self.half.begin(x)
        motion.settle(self.flow.settling)
        y = self.half.iterates(motion, every * (count - 1) + 4) @ self.reader
        first = np.arange(0, len(y) - 3, every)[:count]
        found: Floats = y[first[:, None] + np.arange(4)]
        return found

    def _steered(self, x: Floats, every: int, count: int, far: float) -> Floats:
        """Return the same of a motion that is steered by (2)."""
        last = self.flow.settling + every * (count - 1) + 4
        rows: list[Floats] = []
        for done in range(0, last, BLOCK):
            x = self._changed(x, BLOCK - STRIDE if done else STRIDE, far)
            block = self.half.iterates(self.half.begin(x), BLOCK)
            rows.append(block @ self.reader)
            if len(block) < BLOCK or np.abs(rows[-1]).max() > far:
                break
            x = block[-1]
        y = np.pad(np.concatenate(rows)[:last], (0, 3), constant_values=np.nan)
        return np.array(sliding_window_view(y, 4)[self.flow.settling :: every])

    def _changed(self, x: Floats, first: int, far: float) -> Floats:
        """Return a displacement after the changes (2); none are made for iterates that are far away."""
        m, growth, change, before = 0, 1.0, 0.0, np.zeros(0)
        for n in range(first, AHEAD + 1, STRIDE):
            later = self.half.iterates(self.half.begin(x), n)
            if len(later) < n or np.abs(later @ self.reader).max() > far:
                break
            away = later @ self.left
            if change:
                growth = (away[m - 1] - before[-1]) / change
            growth *= self.outer ** (n - m)
            m, change, before = n, -float(away[-1]) / growth, away
            x = x + change * self.right
        return x
