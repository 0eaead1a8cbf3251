"""Drawing of a mechanism as masses in a row: what is between two masses is drawn in the bay between.

Bay i is left of mass i, bay n right of the last mass. A link is a spring, a dashpot, a stop or
friction between two masses or a mass and the ground. Links of neighbours and of the ground take
lanes in a bay; those of masses further apart pass above. What has no such place is a note below.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from vibroimpact._core.scalars import is_infinite
from vibroimpact.machines.units import Units
from vibroimpact.model.elements.element import Element
from vibroimpact.model.mechanism import Mechanism, element_labels, links
from vibroimpact.plotting import style, symbols
from vibroimpact.plotting.labels import size_of_text
from vibroimpact.plotting.variables import combination

INCHES_PER_UNIT = 0.40  # a unit of the drawing board is so long
MASS, BAY, NARROW, GAP = 2.1, 3.9, 1.2, 0.5
SINGLE, PLAIN, SOFT, DAMPED = 1.0, 1.75, 1.75, 2.1  # heights of lanes, with their labels
POINTS_PER_INCH = 72.0
EXPONENT = re.compile(r"(?<=\d)e([+-]\d+)")
TEXT_POINTS = 8.0  # labels are so high
BELT_LABEL_DEPTH = 0.95  # the first label below a belt is so deep
FLOOR_LABEL_DEPTH = 0.6  # below a floor it is so deep
LABEL_LINE_DEPTH = 0.36  # a line of a label is so deep
A, B, RUB = style.BLUE, style.VERMILION, style.GREEN
Draw = Callable[[Axes, float, float, float], None]  # between two abscissas, at an ordinate


@dataclass
class Law:
    """A stop on one side: where it begins, and its spring and dashpot; none of a rigid one."""

    limit: float
    colour: str
    k: float = 0.0
    c: float = 0.0
    preloaded: bool = False


@dataclass
class Bay:
    """Parts that are drawn between two masses: heights of lanes, and how each is drawn."""

    lanes: list[tuple[float, Draw]] = field(default_factory=list)
    ground: bool = False  # whether it ends at a wall, where it is the first or the last

    @property
    def height(self) -> float:
        """Height of all lanes."""
        return sum(height for height, _ in self.lanes)


class Chain:
    """A mechanism laid out; ``draw`` puts it on axes."""

    def __init__(self, m: Mechanism, units: Units) -> None:
        self.m, self.units, n = m, units, m.degrees
        self.bays = [Bay() for _ in range(n + 1)]
        self.above: list[tuple[int, int, float, Draw]] = []
        self.rubbing: dict[int, list[tuple[str, Element]]] = {}
        self.notes: list[str] = []
        self._supports()
        for label, part in zip(element_labels(m), m.elements, strict=True):
            self._part(label, part)
        self._remarks()

    # ---- links -----------------------------------------------------------------------------------

    def _supports(self) -> None:
        """Springs and dashpots of K and C."""
        for matrix, symbol, quantity, draw in (
            (self.m.stiffness, "k", "stiffness", symbols.spring),
            (self.m.damping, "c", "damping", symbols.dashpot),
        ):
            for i, j, value in links(matrix):
                text = f"${symbol}={self.units.formula(value, quantity)}$"
                if j is None:
                    self._grounded(i, -1, SINGLE, _support(draw, text, -1))
                else:
                    self._between(i, j, SINGLE, _support(draw, text, 0))

    def _grounded(self, i: int, side: int, height: float, draw: Draw, *, wall: bool = True) -> None:
        bay = self.bays[i if side < 0 else i + 1]
        bay.lanes.append((height, draw))
        bay.ground = bay.ground or wall

    def _between(self, i: int, j: int, height: float, draw: Draw) -> None:
        if j == i + 1:
            self.bays[j].lanes.append((height, draw))
        else:
            self.above.append((i, j, height, draw))

    def _part(self, label: str, part: Element) -> None:
        if not part.is_stop and not part.slipping:
            self.notes.append(f"{label}: {part.caption()}")
            return
        where = [i for i, x in enumerate(part.row) if x]
        opposite = len(where) == 2 and part.row[where[0]] == -part.row[where[1]]
        if len(where) > 2 or (len(where) == 2 and not opposite):
            self.notes.append(f"{label}: on ${combination(part.row)}$")
        elif part.slipping:
            if len(where) == 1:
                self.rubbing.setdefault(where[0], []).append((label, part))
            else:
                self._between(where[0], where[1], PLAIN, _rub(label, part))
        elif len(where) == 1:
            self._ground_stop(label, part, where[0])
        else:
            self._stop_between(label, part, where[0], where[1])

    def _ground_stop(self, label: str, part: Element, i: int) -> None:
        factor = part.row[i]
        for side in (-1, 1):  # of the mass
            law = law_of(part, side if factor > 0 else -side)
            if law is None:
                continue
            height = DAMPED if law.c else SOFT if law.k else PLAIN
            limit = self.units.formula(law.limit / factor, "length")
            text = f"{label}: $x_{{{i + 1}}}={limit}$\n{_values(part, law)}"
            outer = i == (0 if side < 0 else self.m.degrees - 1)
            away = bool(part.motion)
            draw = _stop(text, law, side, outer, away)
            self._grounded(i, side, height, draw, wall=not away)

    def _stop_between(self, label: str, part: Element, i: int, j: int) -> None:
        near, far = law_of(part, 1), law_of(part, -1)  # where the masses approach, and part
        if part.row[i] < 0.0:
            near, far = far, near
        laws = sorted((law for law in (far, near) if law), key=lambda law: law.limit)
        at = r",\ ".join(self.units.formula(law.limit, "length") for law in laws)
        text = f"{label}: ${combination(part.row)}={at}$\n{_values(part, *laws)}"
        soft = any(law.k for law in laws)
        height = (DAMPED if any(law.c for law in laws) else SOFT) if soft else PLAIN
        self._between(i, j, height, _slot(text, near, far))

    def _remarks(self) -> None:
        m, n = self.m, self.m.degrees
        if self.units.si:
            self.notes.append("numbers without a unit: in SI units")
        for i in range(n):
            if force := force_text(m, i):
                self.notes.append(f"$F_{{{i + 1}}}={force}$")
        for i in range(n):
            for j in range(i + 1, n):
                at = f"_{{{i + 1}{j + 1}}}"
                if m.mass[i][j]:
                    coupling = self.units.formula(m.mass[i][j], "mass")
                    self.notes.append(f"$m{at}={coupling}$ couples the masses")
                for name, matrix in (("c", m.damping), ("k", m.stiffness)):
                    skew = (matrix[i][j] - matrix[j][i]) / 2.0
                    if skew:
                        kind = "gyroscopic" if name == "c" else "circulatory"
                        self.notes.append(f"${name}{at}-{name}_{{{j + 1}{i + 1}}}={2 * skew:g}$, "
                                          f"{kind}")  # fmt: skip

    # ---- layout ----------------------------------------------------------------------------------

    def places(self) -> tuple[list[tuple[float, float]], list[float]]:
        """Left and right end of every bay, and the left end of every mass."""
        n, x = self.m.degrees, 0.0
        bays, masses = [], []
        for i, bay in enumerate(self.bays):
            width = BAY if bay.lanes else NARROW if 0 < i < n else 0.5
            bays.append((x, x + width))
            x += width
            if i < n:
                masses.append(x)
                x += MASS
        return bays, masses

    @property
    def height(self) -> float:
        """Height of the masses."""
        return max(1.7, *(bay.height + 0.2 for bay in self.bays))

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the drawing."""
        bays, _ = self.places()
        lanes = sum(height for *_, height, _ in self.above)
        return bays[-1][1] + 1.2, self.top + lanes + self.foot

    @property
    def top(self) -> float:
        """Height of the masses with the arrows of their coordinates."""
        return self.height + 1.0

    @property
    def foot(self) -> float:
        """Depth of what is below the masses: floor, belts, labels, notes."""
        depths = [
            (BELT_LABEL_DEPTH if any(moving(e) for _, e in found) else FLOOR_LABEL_DEPTH)
            + sum(LABEL_LINE_DEPTH * (2 if moving(e) else 1) for _, e in found)
            for found in self.rubbing.values()
        ]
        return max([FLOOR_LABEL_DEPTH, *depths]) + 0.1 + 0.45 * len(self.notes)

    # ---- drawing ---------------------------------------------------------------------------------

    def draw(self, ax: Axes) -> None:
        """Draw on axes."""
        bays, masses = self.places()
        n, high = self.m.degrees, self.height
        for i, ((left, right), bay) in enumerate(zip(bays, self.bays, strict=True)):
            if bay.ground and i == 0:
                symbols.wall(ax, left, -0.3, high, -1)
            if bay.ground and i == n:
                symbols.wall(ax, right, -0.3, high, 1)
            y = (high + bay.height) / 2.0
            for height, draw in bay.lanes:
                draw(ax, left, right, y - height)
                y -= height
        for i, x in enumerate(masses):
            self._mass(ax, i, x)
        self._floor(ax, bays, masses)
        y = self.top
        for i, j, height, draw in self.above:
            ends = masses[i] + 0.2 * MASS, masses[j] + 0.2 * MASS
            for x in ends:
                ax.plot([x, x], [high, y + axis_of(height)], **symbols.LINE)
            draw(ax, *ends, y)
            y += height
        width, _ = self.size
        foot = -self.foot + 0.45 * len(self.notes) - 0.2
        for line, note in enumerate(self.notes):
            ax.text(
                0.0, foot - 0.45 * line, with_powers(note), fontsize=TEXT_POINTS + 0.5, va="center"
            )
        ax.set(xlim=(-0.6, width - 0.6), ylim=(-self.foot, y), aspect="equal")
        ax.axis("off")

    def _mass(self, ax: Axes, i: int, x: float) -> None:
        high, middle = self.height, x + MASS / 2.0
        symbols.box(ax, (x, 0.0), MASS, high)
        force = bool(force_text(self.m, i))
        mass = self.units.formula(self.m.mass[i][i], "mass", digits=4)
        name = f"$m_{{{i + 1}}}={mass}$"
        ax.text(middle, high / 2.0 + (0.35 if force else 0.0), name, ha="center", va="center",
                fontsize=9.0)  # fmt: skip
        if force:
            y = high / 2.0 - 0.3
            symbols.arrow(ax, (middle - 0.2, y), (middle + 0.85, y), linewidth=1.4)
            ax.text(middle - 0.3, y, f"$F_{{{i + 1}}}$", ha="right", va="center", fontsize=9.0)
        ax.plot([middle] * 2, [high, high + 0.5], color=style.GREY, linewidth=0.6)
        symbols.arrow(ax, (middle, high + 0.4), (middle + 0.7, high + 0.4))
        ax.text(middle + 0.78, high + 0.4, f"$x_{{{i + 1}}}$", va="center", fontsize=9.0)

    def _floor(self, ax: Axes, bays: list[tuple[float, float]], masses: list[float]) -> None:
        """Floor, wheels, and what rubs: a pad on the floor or on a belt."""
        left = bays[0][0]
        for i, x in enumerate(masses):
            found = self.rubbing.get(i, [])
            if not found:
                symbols.wheels(ax, x + 0.5, x + MASS - 0.5, -0.3)
                continue
            pad = Rectangle((x + 0.35, -0.3), MASS - 0.7, 0.3, facecolor="white", edgecolor=RUB,
                            hatch="//////", lw=0.8)  # fmt: skip
            ax.add_patch(pad)
            belts = [e for _, e in found if moving(e)]
            if belts:
                symbols.floor(ax, left, x - 0.2, -0.3)
                left = x + MASS + 0.2
                symbols.belt(ax, x - 0.2, x + MASS + 0.2, -0.3, RUB)
                way = -1.0 if belts[0].grip.speed < 0.0 else 1.0
                ends = x + MASS / 2 - 0.45 * way, x + MASS / 2 + 0.45 * way
                style_of = "-|>" if belts[0].grip.speed else "<|-|>"
                symbols.arrow(ax, (ends[0], -0.56), (ends[1], -0.56), color=RUB,
                              arrowstyle=style_of)  # fmt: skip
            y = -BELT_LABEL_DEPTH if belts else -FLOOR_LABEL_DEPTH
            for label, e in found:
                text = f"{label}: {e.caption()}"
                ax.text(x + MASS / 2.0, y, text, ha="center", va="top", color=RUB, fontsize=TEXT_POINTS,
                        linespacing=1.1)  # fmt: skip
                y -= LABEL_LINE_DEPTH * (2 if moving(e) else 1)
        symbols.floor(ax, left, bays[-1][1], -0.3)


def draw_chain(m: Mechanism, units: Units, ax: Axes | None) -> Axes:
    """Draw a mechanism on axes, or on a new figure of a size that suits it."""
    chain = Chain(m, units)
    width, height = chain.size
    inches = INCHES_PER_UNIT * width, INCHES_PER_UNIT * height
    with style.drawing(ax, width=inches[0], height=inches[1]) as ax:
        chain.draw(ax)
        style.shrink_texts(ax, *inches)
    return ax


# ---- laws and their texts ------------------------------------------------------------------------


def law_of(part: Element, side: int) -> Law | None:
    """The stop on a side of the contact coordinate; None where there is none."""
    if (spring := part.spring_at(side)) is None or is_infinite(spring.limit):
        return None
    limit, k, c = spring
    colour = A if side > 0 else B
    return Law(limit, colour) if part.rigid else Law(limit, colour, k, c, side * limit < 0.0)


def moving(e: Element) -> bool:
    """Whether an element rubs on a belt that moves."""
    return bool(e.grip.speed or e.motion)


def _values(part: Element, *laws: Law) -> str:
    """The numbers of the sides drawn, and whether they move."""
    sides = (1 if law.colour == A else -1 for law in laws)
    return f"{part.caption(*sides)}{', moves' if part.motion else ''}"


def force_text(m: Mechanism, i: int) -> str:
    """Force on a coordinate as a formula; "" where there is none."""
    terms = [(m.constant_force[i], "")] if m.constant_force[i] else []
    for line in m.forces:
        angle = rf"{line.omega:g}\,t"
        terms += [
            (x, rf"\,\{name}\,{angle}")
            for x, name in ((line.sine[i], "sin"), (line.cosine[i], "cos"))
            if x
        ]
    text = ""
    for number, function in terms:
        size = function.removeprefix(r"\,") if abs(number) == 1.0 else f"{abs(number):g}{function}"
        text += ("-" if number < 0.0 else "+" if text else "") + (size or "1")
    return text


# ---- how a lane is drawn -------------------------------------------------------------------------


def axis_of(height: float) -> float:
    """Height of the middle line of a link between masses above the foot of its lane."""
    return 0.3 if height == SINGLE else 0.55


def _label(ax: Axes, left: float, right: float, y: float, text: str, colour: str) -> None:
    """Write in the middle above a part, smaller where it would be wider than its place."""
    text = with_powers(text)
    wide = max(size_of_text(line, TEXT_POINTS)[0] for line in text.splitlines())
    place = 0.95 * (right - left) * INCHES_PER_UNIT * POINTS_PER_INCH
    points = TEXT_POINTS * min(1.0, place / wide)
    ax.text((left + right) / 2.0, y, text, ha="center", va="bottom", color=colour, fontsize=points,
            linespacing=1.1)  # fmt: skip


def with_powers(text: str) -> str:
    """Text of formulas with powers of ten for exponents: 2.9e+06 is 2.9 x 10^6."""
    return EXPONENT.sub(lambda found: rf"\times10^{{{int(found[1])}}}", text)


def _support(draw: Callable[..., None], text: str, side: int) -> Draw:
    """A spring or dashpot; of the ground (side -1) in an inner bay it ends at a post."""

    def lane(ax: Axes, left: float, right: float, y: float) -> None:
        start = left
        if side and left > 0.0:
            start = right - 0.6 * BAY
            symbols.wall(ax, start, y - 0.05, y + 0.65, -1)
        draw(ax, start, right, y + axis_of(SINGLE), size=0.2)
        _label(ax, start, right, y + 0.54, text, style.BLACK)

    return lane


def _spring_and_dashpot(ax: Axes, x0: float, x1: float, y: float, law: Law) -> None:
    if not law.k:
        ax.plot([x0, x1], [y, y], **symbols.LINE)
        return
    up = 0.22 if law.c else 0.0
    symbols.spring(ax, x0, x1, y + up, size=0.15)
    if law.c:
        symbols.dashpot(ax, x0, x1, y - 0.26, size=0.16)


def _stop(text: str, law: Law, side: int, outer: bool, moving: bool) -> Draw:
    """A stop of the ground, on the right (side 1) or on the left of its mass."""
    size = 0.48 if law.c else 0.32
    gap = 0.0 if law.preloaded else GAP

    def lane(ax: Axes, left: float, right: float, y: float) -> None:
        face = left if side > 0 else right
        y += 0.55 if law.c else 0.4
        fixed = outer and not moving
        base = face + side * (1.0 if fixed else 0.72 if law.k else 0.55) * BAY
        if not fixed:
            symbols.wall(ax, base, y - 0.4, y + 0.4, side)
        symbols.plate(ax, face + side * (gap + 0.04), y, law.colour, size)
        _spring_and_dashpot(ax, face + side * (gap + 0.04), base, y, law)
        if moving:
            away = base + side * 0.35, base + side * 0.85
            symbols.arrow(ax, (away[0], y), (away[1], y), arrowstyle="<|-|>", color=law.colour)
        _label(ax, left, right, y + size + 0.06, text, law.colour)

    return lane


def _slot(text: str, near: Law | None, far: Law | None) -> Draw:
    """A stop between two masses: a head on the left one, before or within a frame of the right one."""
    damped = any(law and law.c for law in (near, far))
    size = 0.44 if damped else 0.3

    def lane(ax: Axes, left: float, right: float, y: float) -> None:
        y += axis_of(SOFT)
        middle, width = (left + right) / 2.0, right - left
        ends = left + 0.12 * width, right - 0.12 * width
        head = middle if far else left + 0.25 * width
        ax.plot([left, head], [y, y], **symbols.LINE)
        ax.plot([head, head], [y - 0.6 * size, y + 0.6 * size], color=style.BLACK, linewidth=2.6)
        if far:
            for sign in (-1, 1):
                ax.plot([right, ends[0]], [y + sign * size] * 2, **symbols.LINE)
                ax.plot([ends[0]] * 2, [y + 0.15 * sign, y + sign * size], color=far.colour,
                        linewidth=2.6)  # fmt: skip
            if far.k:
                _spring_and_dashpot(ax, ends[0], head - 0.45, y, far)
                symbols.plate(ax, head - 0.45, y, far.colour, 0.6 * size)
        if near:
            face = head + 0.45 if near.k else ends[1]
            symbols.plate(ax, face, y, near.colour, 0.6 * size)
            _spring_and_dashpot(ax, face, right, y, near)
        _label(ax, left, right, y + size + 0.06, text, (near or far or Law(0.0, A)).colour)

    return lane


def _rub(label: str, e: Element) -> Draw:
    """Two plates that slide on each other."""

    def lane(ax: Axes, left: float, right: float, y: float) -> None:
        y += axis_of(PLAIN)
        width = right - left
        ax.plot([left, left + 0.68 * width], [y + 0.07] * 2, **symbols.LINE)
        ax.plot([left + 0.32 * width, right], [y - 0.07] * 2, **symbols.LINE)
        low, size = left + 0.32 * width, 0.36 * width
        ax.add_patch(Rectangle((low, y - 0.07), size, 0.14, facecolor="white", edgecolor=RUB,
                               hatch="//////", lw=0.8))  # fmt: skip
        for sign in (-1, 1):
            symbols.arrow(ax, (low + size / 2, y + 0.5 * sign), (low + size / 2, y + 0.1 * sign),
                          color=RUB)  # fmt: skip
        _label(ax, left, right, y + 0.55, f"{label}: {e.caption()}", RUB)

    return lane
