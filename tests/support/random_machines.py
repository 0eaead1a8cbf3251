"""Random machines of every element, and the same machine in other units, mirrored, or in another order.

Every number of a mechanism has a dimension, listed in DIMENSIONS: a field that is not listed fails.

    units       x = L x', t = T t', m = M m': a length is times L, a force times M L / T^2, and so on
    mirrored    x = -x': limits of a stop change places and signs, forces and speeds their signs
    renumbered  coordinate i' is coordinate order[i']
    reordered   contact i' is contact contacts[i'], element i' element elements[i']
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

import vibroimpact as vi

Exponents = tuple[int, int, int]  # of mass, length, time
LENGTH, SPEED, STIFF, DASH = (0, 1, 0), (0, 1, -1), (1, 0, -2), (1, 0, -1)
FORCE, IMPULSE, RATE, PURE = (1, 1, -2), (1, 1, -1), (0, 0, -1), (0, 0, 0)

DIMENSIONS: dict[str, dict[str, Exponents | None]] = {  # of a Harmonic: those of its amplitudes
    "Mechanism": {
        "mass": (1, 0, 0), "damping": DASH, "stiffness": STIFF, "forces": FORCE,
        "constant_force": FORCE, "elements": None, "impact_law": None, "si": None,
    },
    "RigidStop": {
        "row": PURE, "lower": LENGTH, "upper": LENGTH, "restitution": PURE, "motion": LENGTH,
        "active": None,
    },
    "SoftStop": {
        "row": PURE, "lower": LENGTH, "upper": LENGTH, "stiffness": STIFF, "damping": DASH,
        "law": None, "motion": LENGTH,
    },
    "Friction": {
        "row": PURE, "kinetic": FORCE, "static": FORCE, "belt_speed": SPEED, "motion": LENGTH,
        "load": None,
    },
    "NormalLoad": {"constant": FORCE, "position": STIFF, "velocity": DASH, "motion": FORCE},
    "PhaseSwitch": {
        "omega": RATE, "phases": PURE, "forces": FORCE, "impulses": IMPULSE, "row": PURE,
        "stiffness": STIFF, "damping": DASH,
    },
}  # fmt: skip
ODD = {FORCE, LENGTH, SPEED, IMPULSE}  # what changes its sign where x does
SIDES = {"lower": "upper", "upper": "lower"}
PARTS = (vi.RigidStop, vi.SoftStop, vi.Friction, vi.NormalLoad, vi.PhaseSwitch)
Unit = tuple[float, float, float]  # of mass, length, time


def _dimension(part: Any, name: str) -> Exponents | None:
    found = DIMENSIONS[type(part).__name__][name]
    # with a load, levels are coefficients
    return PURE if name in ("kinetic", "static") and part.load is not None else found


# ---- other units ------------------------------------------------------------------------------------


def in_units(value: Any, dimension: Exponents, units: Unit) -> Any:
    """A number, or any nest of numbers and lines, of a dimension."""
    if isinstance(value, vi.Harmonic):
        sine, cosine = (in_units(part, dimension, units) for part in (value.sine, value.cosine))
        return vi.Harmonic(value.omega / units[2], sine, cosine)
    if isinstance(value, tuple | list):
        return type(value)(in_units(x, dimension, units) for x in value)
    for exponent, unit in zip(dimension, units, strict=True):
        for _ in range(abs(exponent)):
            value = value * unit if exponent > 0 else value / unit
    return value


def scaled(thing: Any, length: float = 1.0, time: float = 1.0, mass: float = 1.0) -> Any:
    """A mechanism, one of its parts or a state, with numbers as they are in other units.

    Every length is times ``length``, every time times ``time``; powers of two are exact.
    """
    units = mass, length, time
    if isinstance(thing, vi.State):
        return vi.State(
            in_units(thing.position, LENGTH, units),
            in_units(thing.velocity, SPEED, units),
            thing.phase,
        )
    out = {}
    for field in fields(thing):
        value = getattr(thing, field.name)
        dimension = _dimension(thing, field.name)
        if isinstance(value, PARTS):
            out[field.name] = scaled(value, length, time, mass)
        elif isinstance(value, tuple) and value and isinstance(value[0], PARTS):
            out[field.name] = tuple(scaled(part, length, time, mass) for part in value)
        elif dimension is not None:
            out[field.name] = in_units(value, dimension, units)
    return replace(thing, **out)


# ---- mirrored ---------------------------------------------------------------------------------------


def _negative(value: Any) -> Any:
    if isinstance(value, vi.Harmonic):
        return vi.Harmonic(value.omega, _negative(value.sine), _negative(value.cosine))
    return type(value)(_negative(x) for x in value) if isinstance(value, tuple | list) else -value


def mirrored(thing: Any) -> Any:
    """A mechanism, one of its parts or a state seen in a mirror: every coordinate is its negative."""
    if isinstance(thing, vi.State):
        return vi.State(_negative(thing.position), _negative(thing.velocity), thing.phase)
    if isinstance(thing, vi.NormalLoad):  # a load is what it is; it comes from the other side
        return replace(
            thing, position=_negative(thing.position), velocity=_negative(thing.velocity)
        )
    out: dict[str, Any] = {}
    stop = isinstance(thing, vi.RigidStop | vi.SoftStop)
    for field in fields(thing):
        name, value = field.name, getattr(thing, field.name)
        dimension = _dimension(thing, name)
        if isinstance(value, PARTS):
            out[name] = mirrored(value)
        elif isinstance(value, tuple) and value and isinstance(value[0], PARTS):
            out[name] = tuple(mirrored(part) for part in value)
        elif stop and name in ("restitution", "stiffness", "damping"):
            out[name] = value[::-1]
        elif dimension in ODD and not (isinstance(thing, vi.Friction) and dimension == FORCE):
            out[SIDES.get(name, name)] = _negative(value)
    return replace(thing, **out)


# ---- in another order -------------------------------------------------------------------------------


def renumbered(thing: Any, order: Sequence[int]) -> Any:
    """A mechanism, one of its parts or a state whose coordinate i is that which was ``order[i]``."""

    def turned(vector: Any) -> Any:
        return tuple(vector[i] for i in order) if len(vector) else vector

    if isinstance(thing, vi.State):
        return vi.State(turned(thing.position), turned(thing.velocity), thing.phase)
    if isinstance(thing, vi.RigidStop | vi.SoftStop):
        return replace(thing, row=turned(thing.row))
    if isinstance(thing, vi.Friction):
        load = None if thing.load is None else renumbered(thing.load, order)
        return replace(thing, row=turned(thing.row), load=load)
    if isinstance(thing, vi.NormalLoad):
        return replace(thing, position=turned(thing.position), velocity=turned(thing.velocity))
    if isinstance(thing, vi.PhaseSwitch):
        forces, impulses = (tuple(map(turned, rows)) for rows in (thing.forces, thing.impulses))
        return replace(thing, forces=forces, impulses=impulses, row=turned(thing.row))
    if isinstance(thing, vi.Harmonic):
        return vi.Harmonic(thing.omega, turned(thing.sine), turned(thing.cosine))
    matrices = {
        name: [[getattr(thing, name)[i][j] for j in order] for i in order]
        for name in ("mass", "damping", "stiffness")
    }
    several = {
        name: tuple(renumbered(part, order) for part in getattr(thing, name))
        for name in ("elements", "forces")
    }
    return replace(thing, constant_force=turned(thing.constant_force), **matrices, **several)


def reordered(m: vi.Mechanism, contacts: Sequence[int], elements: Sequence[int]) -> vi.Mechanism:
    """The machine with its contacts and elements in another order; forcing lines keep theirs."""
    return replace(
        m,
        elements=(*(m.rigid_stops[i] for i in contacts), *(m.switching[i] for i in elements)),
    )


# ---- nearby ----------------------------------------------------------------------------------------

CHANGE = 1e-12


def changed(m: vi.Mechanism, state: vi.State) -> tuple[vi.Mechanism, vi.State]:
    """Forces, stiffnesses, speeds changed by CHANGE of themselves: starts stay on their stops."""
    more = 1.0 + CHANGE
    forces = tuple(
        vi.Harmonic(f.omega, tuple(x * more for x in f.sine), tuple(x * more for x in f.cosine))
        for f in m.forces
    )
    stiffness = [[x / more for x in row] for row in m.stiffness]
    still = not any(contact.motion for contact in m.rigid_stops)
    velocity = tuple(x * more for x in state.velocity) if still else state.velocity
    return replace(m, forces=forces, stiffness=stiffness), vi.State(
        state.position, velocity, state.phase
    )


# ---- random machines --------------------------------------------------------------------------------

KINDS: dict[str, tuple[str, ...]] = {  # elements of each, and words about its matrices
    "rigid": ("rigid",),
    "two-sided rigid": ("two-sided rigid",),
    "plastic": ("plastic",),
    "rigid beside rigid": ("rigid", "two-sided rigid"),
    "heavy on stops": ("floor", "floor"),
    "moving rigid": ("moving rigid",),
    "soft, by force": ("soft, by force",),
    "soft, by gap": ("soft, by gap",),
    "two-sided soft": ("two-sided soft",),
    "preloaded soft": ("preloaded soft",),
    "moving soft": ("moving soft",),
    "friction": ("friction",),
    "static friction": ("static friction",),
    "belt": ("belt",),
    "swinging belt": ("swinging belt",),
    "loaded friction": ("loaded friction",),
    "two frictions": ("friction", "static friction"),
    "switched": ("switch", "rigid"),
    "kicked": ("kicks", "soft, by gap"),
    "rigid and friction": ("rigid", "friction"),
    "plastic and friction": ("plastic", "static friction"),
    "rigid and soft": ("two-sided rigid", "soft, by force"),
    "floor and soft": ("floor", "two-sided soft"),
    "floor and belt": ("floor", "belt"),
    "massless": ("massless", "rigid", "soft, by force"),
    "slider": ("slider", "rigid"),
    "nonsymmetric": ("nonsymmetric", "rigid", "soft, by gap", "friction"),
    "moving everything": ("moving rigid", "moving soft", "swinging belt"),
    "all": ("rigid", "moving rigid", "two-sided soft", "static friction", "switch"),
}
MATRICES = ("nonsymmetric", "massless")


def random_machine(
    rng: np.random.Generator, kinds: Sequence[str] = ("rigid",), degrees: int | None = None
) -> vi.Mechanism:
    """A machine with these elements; up to three coordinates with coupled matrices, or ``degrees``.

    It has one to three forcing lines. A third of the machines have no damping matrix, a third
    Rayleigh's; a quarter have free masses. A coordinate without mass comes last.
    """
    light = "massless" in kinds or "slider" in kinds
    joints = sum("friction" in kind or "belt" in kind for kind in kinds)
    rigid = any(word in kind for kind in kinds for word in ("rigid", "plastic", "floor"))
    least = max(
        1 + light, joints + (joints > 0 and rigid)
    )  # on one coordinate forces are shared anyhow
    n = degrees or int(rng.integers(min(3, least), 4))
    a, b, c, d = (rng.normal(size=(n, n)) for _ in range(4))
    rank = n - int(rng.random() < 0.25 and not light)
    mass = a @ a.T / n + np.eye(n)
    stiffness = b[:, :rank] @ b[:, :rank].T + 0.3 * (rank == n) * np.eye(n)
    damping = ((0.0, 0.0), (0.03, 0.02), (0.0, 0.0))[which := int(rng.integers(3))]
    damping = damping[0] * stiffness + damping[1] * mass + 0.1 * (which == 2) * c @ c.T
    if light:
        mass[-1], mass[:, -1], damping[-1], damping[:, -1] = 0.0, 0.0, 0.0, 0.0
    if "massless" in kinds:  # a dashpot to the ground and one to the coordinate before
        damping[-2:, -2:] += [[0.2, -0.2], [-0.2, 0.5]]
    if "nonsymmetric" in kinds:
        damping, stiffness = damping + 0.2 * (d - d.T), stiffness + 0.1 * rng.normal(size=(n, n))
    omegas = [float(rng.uniform(0.5, 2.0))]
    omegas += [omegas[0] * ratio for ratio in (0.5, math.sqrt(2.0))]
    lines = omegas[: 1 + int(rng.integers(0, 3))]
    heavy = np.array([1.0] * (n - light) + [0.0] * light)
    forces = tuple(
        vi.Harmonic(w, _vector(rng, heavy, 1.5 / (1 + k)), _vector(rng, heavy, 1.0 / (1 + k)))
        for k, w in enumerate(lines)
    )
    floors = sum(kind == "floor" for kind in kinds)
    push = 0.3 * rng.normal(size=n) * heavy * (rng.random() < 0.5)
    push[:floors] = -rng.uniform(1.0, 4.0, size=min(floors, n))
    parts = [
        _part(rng, kind, heavy, omegas, i) for i, kind in enumerate(kinds) if kind not in MATRICES
    ]
    return vi.Mechanism(
        mass=mass, damping=damping, stiffness=stiffness, forces=forces,
        constant_force=tuple(map(float, push)), elements=tuple(parts),
    )  # fmt: skip


def _vector(rng: np.random.Generator, heavy: Any, size: float) -> tuple[float, ...]:
    """A random vector; nothing on coordinates without mass."""
    return tuple(map(float, size * rng.normal(size=len(heavy)) * heavy))


def _part(rng: np.random.Generator, kind: str, heavy: Any, omegas: list[float], i: int) -> Any:
    """One element by its name; the i-th floor is below coordinate i."""
    n = len(heavy)

    def flat(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    def line(size: float) -> tuple[vi.Harmonic, ...]:
        a, b = size * rng.normal(size=2)
        return (vi.Harmonic(omegas[int(rng.integers(3))], (float(a),), (float(b),)),)

    row = _vector(rng, heavy, 1.0)
    restitution = float(rng.choice([0.0, 1.0])) if rng.random() < 0.2 else flat(0.3, 0.95)
    law = ("linear", "unilateral")["force" in kind]
    if kind == "floor":
        return vi.RigidStop(
            tuple(map(float, np.eye(n)[i % n])), lower=0.0, restitution=flat(0.0, 0.8)
        )
    if kind in ("rigid", "plastic"):
        return vi.RigidStop(row, upper=flat(0.1, 1.0), restitution=restitution * (kind == "rigid"))
    if kind == "two-sided rigid":
        return vi.RigidStop(row, lower=-flat(0.3, 1.0), upper=flat(0.3, 1.0),
                            restitution=(restitution, flat(0.3, 0.9)))  # fmt: skip
    if kind == "moving rigid":
        return vi.RigidStop(row, upper=flat(0.5, 1.0), restitution=restitution, motion=line(0.1))
    if kind in ("soft, by force", "soft, by gap"):
        return vi.SoftStop(row, upper=flat(0.0, 1.0), stiffness=flat(5.0, 50.0),
                           damping=flat(0.0, 2.0), law=law)  # fmt: skip
    if kind in ("two-sided soft", "moving soft"):
        return vi.SoftStop(
            row, lower=-flat(0.0, 1.0), upper=flat(0.0, 1.0), law=("linear", "unilateral")[int(rng.integers(2))],
            stiffness=(flat(5.0, 50.0), flat(5.0, 50.0)), damping=(0.0, flat(0.0, 2.0)),
            motion=line(0.1) if kind == "moving soft" else (),
        )  # fmt: skip
    if kind == "preloaded soft":
        return vi.SoftStop(
            row, upper=-flat(0.0, 0.3), stiffness=flat(2.0, 20.0), damping=flat(0.0, 1.0)
        )
    if kind == "switch":
        phases = tuple(sorted(flat(0.0, 6.2) for _ in range(2)))
        return vi.PhaseSwitch(
            omegas[0], phases, (_vector(rng, heavy, 0.7), _vector(rng, heavy, 0.7))
        )
    if kind == "kicks":
        return vi.PhaseSwitch(omegas[0], (flat(0.0, 3.0), flat(3.2, 6.2)), ((0.0,) * n,) * 2,
                              (_vector(rng, heavy, 0.5), _vector(rng, heavy, 0.5)))  # fmt: skip
    kinetic, belt = flat(0.1, 1.0), {}
    if kind == "slider":
        return vi.Friction(tuple(1.0 - heavy), kinetic)
    level = kinetic * flat(1.0, 1.5) if kind != "friction" else None
    if kind in ("belt", "swinging belt"):
        belt = {"belt_speed": flat(-0.4, 0.4)}
    if kind == "swinging belt":
        belt["motion"] = line(0.3)
    if kind == "loaded friction":
        load = vi.NormalLoad(
            flat(0.5, 1.5), _vector(rng, heavy, 0.1), _vector(rng, heavy, 0.05), line(0.3)
        )
        return vi.Friction(row, kinetic, level, load=load)
    assert kind in ("friction", "static friction", "belt", "swinging belt"), kind
    return vi.Friction(row, kinetic, level, **belt)


def random_start(rng: np.random.Generator, m: vi.Mechanism) -> vi.State:
    """A state within all clearances; one in five is on a rigid stop, which it leaves or rests on."""
    phase = float(rng.uniform(0.0, 2.0 * math.pi))
    size = 0.5
    for _ in range(200):
        x, v = size * rng.normal(size=m.degrees), rng.normal(size=m.degrees)
        for i in m.sliders.values():  # its forces balance: beyond its level it would jump
            x[i] = 0.0
            x[i] = -(np.array(m.stiffness[i]) @ x) / m.stiffness[i][i]
        size *= 0.9
        if all(gap > 1e-3 for contact in m.rigid_stops for gap in gaps(m, contact, x, phase)):
            break
    else:
        raise RuntimeError("no start within the clearances was found")
    if m.rigid_stops and rng.random() < 0.2:
        x, v = _on_stop(rng, m, x, v, phase)
    return vi.State(tuple(map(float, x)), tuple(map(float, v)), phase)


def _on_stop(rng: np.random.Generator, m: vi.Mechanism, x: Any, v: Any, phase: float) -> Any:
    """The state put onto a stop along its row, departing or at rest relative to it, if others allow."""
    c = m.rigid_stops[int(rng.integers(len(m.rigid_stops)))]
    row = np.array(c.row)
    upper, lower = gaps(m, c, x, phase)
    side, gap = (1.0, upper) if upper < lower else (-1.0, lower)
    there = x + side * gap * row / (row @ row)
    others = [g for other in m.rigid_stops if other is not c for g in gaps(m, other, there, phase)]
    if others and min(others) < 1e-3:
        return x, v
    rate = row @ v - moved(m, c.motion, phase)[1]
    wanted = -side * abs(rate) * (rng.random() < 0.7)
    return there, v + (wanted - rate) * row / (row @ row)


def moved(m: vi.Mechanism, motion: Sequence[vi.Harmonic], phase: float) -> tuple[float, float]:
    """Place and speed of a motion at a phase of the first forcing line."""
    place = speed = 0.0
    for line in motion:
        angle = phase * line.omega / m.omega
        sin, cos = math.sin(angle), math.cos(angle)
        place += line.sine[0] * sin + line.cosine[0] * cos
        speed += line.omega * (line.sine[0] * cos - line.cosine[0] * sin)
    return place, speed


def gaps(m: vi.Mechanism, contact: vi.RigidStop, x: Any, phase: float) -> tuple[float, float]:
    """Gaps at the upper and at the lower stop of a contact."""
    u = float(np.dot(contact.row, x)) - moved(m, contact.motion, phase)[0]
    return contact.upper - u, u - contact.lower
