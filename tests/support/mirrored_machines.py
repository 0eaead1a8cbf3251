"""Random machines of every element, and the same ones seen from the other side or numbered otherwise.

Events of a machine are compared with those of its images: mirrored (x -> -x, upper and lower stops
exchanged), and with coordinates and elements in another order. Of both the motion is known from that
of the machine itself.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

import vibroimpact as vi

Element = vi.RigidStop | vi.SoftStop | vi.Friction


class Case(NamedTuple):
    """A machine as its parts, so that images of it can be made, and a state to start from."""

    parts: dict[str, Any]
    elements: list[Element]
    start: vi.State

    def build(self) -> vi.Mechanism:
        return vi.Mechanism(**self.parts, elements=tuple(self.elements))

    def numbers(self) -> list[int]:
        """Number of each element in events: rigid stops come first."""
        rigid = [i for i, e in enumerate(self.elements) if isinstance(e, vi.RigidStop)]
        others = [i for i in range(len(self.elements)) if i not in rigid]
        order = [*rigid, *others]
        return [order.index(i) for i in range(len(order))]


def random_case(seed: int) -> Case:
    """One to three coordinates, one or two lines, and one to four elements of any kind.

    Rows are often those of single coordinates, restitutions often zero, and starts often at rest on a
    stop: there friction, stops and springs decide at one instant what moves.
    """
    rng = np.random.default_rng(seed)
    flat = lambda low, high: float(rng.uniform(low, high))  # noqa: E731
    n = int(rng.integers(1, 4))
    a, b = rng.normal(size=(n, n)), rng.normal(size=(n, n))
    plain = rng.random() < 0.5
    mass = np.diag(rng.uniform(0.3, 3.0, n)) if plain else a @ a.T + n * np.eye(n)
    stiffness = np.diag(rng.uniform(0.2, 2.0, n)) if plain else b @ b.T + 0.3 * np.eye(n)
    omegas = [flat(0.5, 2.0) * x for x in (1.0, math.sqrt(2.0))][: int(rng.integers(1, 3))]
    vector = lambda size: tuple(map(float, size * rng.normal(size=n)))  # noqa: E731
    parts = {
        "mass": mass, "damping": flat(0.0, 0.1) * stiffness, "stiffness": stiffness,
        "forces": tuple(vi.Harmonic(w, vector(2.0), vector(1.0)) for w in omegas),
        "constant_force": vector(0.7),
    }  # fmt: skip

    def row() -> tuple[float, ...]:
        if rng.random() < 0.7:
            return tuple(map(float, np.eye(n)[rng.integers(n)]))
        return vector(1.0)

    def line(size: float) -> tuple[vi.Harmonic, ...]:
        w = omegas[int(rng.integers(len(omegas)))]
        return (vi.Harmonic(w, (size * flat(-1.0, 1.0),), (size * flat(-1.0, 1.0),)),)

    def element(kind: str) -> Element:
        if kind == "soft":
            both = rng.random() < 0.3
            return vi.SoftStop(
                row(), lower=-flat(0.0, 1.0) if both else -math.inf, upper=flat(0.0, 1.0),
                stiffness=(flat(5.0, 50.0), flat(5.0, 50.0)), damping=(flat(0.0, 2.0), flat(0.0, 2.0)),
                law=("linear", "unilateral", "limited")[int(rng.integers(3))],
            )  # fmt: skip
        if kind == "friction":
            kinetic = flat(0.1, 1.5)
            return vi.Friction(
                row(), kinetic=kinetic, static=kinetic * float(rng.choice([1.0, 1.3])),
                belt_speed=float(rng.choice([0.0, 0.0, 0.3])),
                motion=line(0.2) if rng.random() < 0.2 else (),
            )  # fmt: skip
        both = rng.random() < 0.4
        return vi.RigidStop(
            row(), lower=0.0, upper=flat(0.3, 1.5) if both else math.inf,
            restitution=float(rng.choice([0.0, flat(0.2, 0.9)])),
            motion=line(0.1) if not both and rng.random() < 0.2 else (),
        )  # fmt: skip

    kinds = [str(rng.choice(["rigid", "friction", "soft"], p=[0.45, 0.4, 0.15]))
             for _ in range(int(rng.integers(1, 5)))]  # fmt: skip
    elements: list[Element] = []
    for kind in kinds:  # of two rigid stops in one place either may carry the force
        drawn = element(kind)
        rows = [e.row for e in (*elements, drawn) if isinstance(e, vi.RigidStop)]
        if not isinstance(drawn, vi.RigidStop) or np.linalg.matrix_rank(np.array(rows)) == len(
            rows
        ):
            elements.append(drawn)
    phase = flat(0.0, 6.0)
    for trial in range(200):
        at_rest = trial == 0 or rng.random() < 0.3
        x, v = (0.0 if at_rest else 0.5) * rng.normal(size=n), rng.normal(size=n)
        start = vi.State(
            tuple(map(float, x)), (0.0,) * n if at_rest else tuple(map(float, v)), phase
        )
        case = Case(parts, elements, start)
        try:
            vi.simulate(case.build(), start, t_max=1e-9)
        except vi.InvalidParameterError:
            continue
        return case
    return random_case(seed + 10**6)


def minus(x: Any) -> Any:
    return tuple(-y for y in x) if isinstance(x, tuple) else -x


def reverse(lines: tuple[vi.Harmonic, ...]) -> tuple[vi.Harmonic, ...]:
    return tuple(vi.Harmonic(h.omega, minus(h.sine), minus(h.cosine)) for h in lines)


def both(x: Any) -> tuple[Any, Any]:
    return x if isinstance(x, tuple) else (x, x)


def mirrored(case: Case) -> Case:
    """The same machine in coordinates -x."""

    def image(e: Element) -> Element:
        if isinstance(e, vi.Friction):
            return replace(e, belt_speed=-e.belt_speed, motion=reverse(e.motion))
        limits = {"lower": -e.upper, "upper": -e.lower}
        if isinstance(e, vi.SoftStop):
            return replace(e, **limits, stiffness=both(e.stiffness)[::-1],
                           damping=both(e.damping)[::-1], motion=reverse(e.motion))  # fmt: skip
        return replace(e, **limits, restitution=both(e.restitution)[::-1], motion=reverse(e.motion))

    parts = case.parts | {"forces": reverse(case.parts["forces"]),
                          "constant_force": minus(case.parts["constant_force"])}  # fmt: skip
    s = case.start
    start = vi.State(minus(s.position), minus(s.velocity), s.phase)
    return Case(parts, [image(e) for e in case.elements], start)


def renumbered(case: Case, rng: np.random.Generator) -> tuple[Case, list[int], list[int]]:
    """Coordinates and elements in another order: new place of each."""
    n = len(case.start.position)
    order, places = (
        [*map(int, rng.permutation(n))],
        [*map(int, rng.permutation(len(case.elements)))],
    )
    pick = lambda x: tuple(x[i] for i in order)  # noqa: E731
    p = case.parts
    parts = {
        **{k: np.asarray(p[k])[np.ix_(order, order)] for k in ("mass", "damping", "stiffness")},
        "forces": tuple(vi.Harmonic(h.omega, pick(h.sine), pick(h.cosine)) for h in p["forces"]),
        "constant_force": pick(p["constant_force"]),
    }
    elements = [replace(case.elements[i], row=pick(case.elements[i].row)) for i in places]
    s = case.start
    start = vi.State(pick(s.position), pick(s.velocity), s.phase)
    return Case(parts, elements, start), order, places


class Event(NamedTuple):
    """An event as it can be compared."""

    time: float
    what: str
    element: int  # as the case numbers them, -1 for none
    side: int
    states: tuple[str, ...]  # of every element after it
    position: np.ndarray


# Events of several elements at one instant are named after the first of them in the order given.
NAMED = {"IMPACT", "GRAZING", "CHATTER", "RELEASE", "ENGAGE"}


def events(case: Case, t_max: float, impacts: int) -> tuple[list[Event], str]:
    """Events, up to one for which the law does not decide between states, and how the run ends."""
    m = case.build()
    run = vi.simulate(m, case.start, t_max=t_max, impacts=impacts)
    numbers, kinds = case.numbers(), [e.State for e in m.elements]
    out = []
    for k, status in enumerate(run.status):
        what, number = vi.Status(int(status)).name, int(run.contact[k])
        named = what in NAMED
        states = [kinds[i](int(run.all_states[k][i])).name for i in numbers]
        out.append(
            Event(float(run.time[k]), what, numbers.index(number) if named else -1,
                  int(run.side[k]) if named else 0, tuple(states), run.position[k])
        )  # fmt: skip
        if what == "NON_UNIQUE":
            return out, what
    return out, run.end.name


OPPOSITE = {"UPPER": "LOWER", "FORWARD": "BACKWARD", "BEHIND_UPPER": "BEHIND_LOWER",
            "LIMITED_UPPER": "LIMITED_LOWER"}  # fmt: skip
OPPOSITE |= {y: x for x, y in OPPOSITE.items()}


def seen_mirrored(e: Event) -> Event:
    """An event of a mirrored machine as one of the machine itself."""
    states = tuple(OPPOSITE.get(s, s) for s in e.states)
    return e._replace(side=-e.side, states=states, position=-e.position)


def seen_in_order(e: Event, order: list[int], places: list[int]) -> Event:
    """An event of a renumbered machine as one of the machine itself."""
    position, states = np.empty_like(e.position), [""] * len(places)
    position[order] = e.position
    for i, place in enumerate(places):
        states[place] = e.states[i]
    element = places[e.element] if e.element >= 0 else -1
    return e._replace(element=element, states=tuple(states), position=position)


def difference(image: list[Event], own: list[Event], tolerance: float) -> str:
    """What differs first between the events of a machine and those of an image; "" for nothing."""
    for k, (a, b) in enumerate(zip(own, image, strict=False)):
        apart = max(abs(a.time - b.time), float(np.abs(a.position - b.position).max()))
        same = (a.what, a.element, a.side, a.states) == (b.what, b.element, b.side, b.states)
        if not same or not apart <= tolerance:
            return f"event {k}: {a} or {b}"
    return "" if len(own) == len(image) else f"{len(own)} or {len(image)} events"
