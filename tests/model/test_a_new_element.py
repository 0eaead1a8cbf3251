"""What an element costs: a file of what it says of itself, a file of its rows, and a line in the table of each."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from support.changed_package import PACKAGE, package_copy, run_with

import vibroimpact as vi
from vibroimpact.model.elements.table import KINDS

MODEL = '''
"""A spring with a dead band: without force within it, with stiffness on both sides of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import ClassVar

from vibroimpact.model.elements.element import Element, Look, Spring, nonzero_row, symbols_of


class DeadBandState(IntEnum):
    """States of a spring with a dead band."""

    OPEN = 0
    UPPER = 1
    LOWER = 2


@dataclass(frozen=True, slots=True)
class DeadBand(Element):
    """A force -stiffness (u - upper) along row where u = row . x is above the band, below it likewise."""

    kind: ClassVar[str] = "dead_band"
    State = DeadBandState
    looks: ClassVar[Mapping[int, Look]] = {
        DeadBandState.UPPER: Look("above the band", "blue"),
        DeadBandState.LOWER: Look("below the band", "vermilion"),
    }
    is_stop = True
    motion = ()

    row: tuple[float, ...]
    lower: float
    upper: float
    stiffness: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "row", nonzero_row(self.row, "a dead band"))

    def spring_at(self, side: int) -> Spring:
        """The same spring on both sides."""
        return Spring(self.upper if side > 0 else self.lower, self.stiffness, 0.0)

    def caption(self, *sides: int) -> str:
        """Its stiffness."""
        return symbols_of(k=[self.stiffness])
'''
ROWS = '''
"""Springs with a dead band: force and limits of every state."""

from __future__ import annotations

import math

from vibroimpact.compile.elements.element import ElementRows, Limits
from vibroimpact.model.elements.dead_band import DeadBand


class DeadBandRows(ElementRows[DeadBand]):
    """A spring with a dead band."""

    def force(self, state):
        """That of the spring."""
        if (spring := self.element.pressed(state)) is None:
            return None
        out = [spring.stiffness * x for x in self.gap]
        out[-1] = out[-1] - spring.stiffness * spring.limit
        return out, -1

    def limits(self, state, hold, *, pinned):
        """Where the band begins."""
        e = self.element
        bounds = ((e.lower, e.upper), (e.upper, math.inf), (-math.inf, e.lower))[state]
        return [Limits(self.gap, *bounds)]
'''
CHILD = """
import json
from dataclasses import replace
from pathlib import Path

import matplotlib
matplotlib.use("agg")

import vibroimpact as vi
from vibroimpact import plotting
from vibroimpact.machines.json_text import system_of, text_of
from vibroimpact.machines.toml_file import read_case
from vibroimpact.model.elements.dead_band import DeadBand

Path("machine.toml").write_text('''
[mechanism]
mass = [[1.0]]
damping = [[0.0]]
stiffness = [[0.0]]
[[mechanism.elements]]
kind = "dead_band"
row = [1.0]
lower = -1.0
upper = 1.0
stiffness = 9.0
''')
free = read_case("machine.toml").system
run = vi.simulate(free, vi.State((0.0,), (1.0,)), t_max=20.0)
ax = plotting.plot_mechanism(free)
shown = [text.get_text() for text in ax.texts]
ax = plotting.plot_history(run, 0.0, 20.0)
shown += [text.get_text() for text in ax.texts] + ax.get_legend_handles_labels()[1]

forced = replace(free, damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(1.5, (1.0,)),))
orbit = vi.find_orbit(forced, vi.State((0.0,), (1.0,)))
branch = vi.continue_orbit(orbit, "elements[0].stiffness", (4.0, 12.0))
vi.save(branch, "branch.nc")
again = vi.load("branch.nc")
swept = vi.sweep(forced, over={"elements[0].upper": [0.8, 1.0]}, start=vi.State((0.0,), (1.0,)),
                 settle_periods=5, periods=20, observe=["final", "states"], progress=False)
print(json.dumps({
    "restored": [system_of(text_of(one)) == one for one in (free, forced)],
    "time": run.time.tolist(), "states": run.states[:, 0].tolist(), "status": run.status.tolist(),
    "force": run.forces([0.5, 1.0 + 0.5 * 3.14159265358979 / 3.0])[:, 0].tolist(), "shown": shown,
    "orbit": [orbit.converged, list(map(abs, orbit.multipliers.tolist()))],
    "ends": [float(again.values[0]), float(again.values[-1])],
    "special": [[p.label, p.parameter] for p in again.special_points],
    "final": swept.final_position.values.tolist(),
}))
"""


def line_added(table: Path, after: str, line: str, module: str, name: str) -> None:
    """Add an element to a table, and its import."""
    text, first = table.read_text(), "from vibroimpact."
    assert after in text
    text = text.replace(first, f"from vibroimpact.{module} import {name}\n{first}", 1)
    table.write_text(text.replace(after, after + line))


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What a copy of the package with an element more finds."""
    folder = tmp_path_factory.mktemp("element")
    package = package_copy(folder)
    (package / "model" / "elements" / "dead_band.py").write_text(MODEL)
    (package / "compile" / "elements" / "dead_band.py").write_text(ROWS)
    model, rows = "model.elements", "compile.elements"
    for table, after, line, module, name in (
        (model, "(RigidStop,", " DeadBand,", f"{model}.dead_band", "DeadBand"),
        (rows, "= {", '"dead_band": DeadBandRows,', f"{rows}.dead_band", "DeadBandRows"),
    ):
        line_added(package / table.replace(".", "/") / "table.py", after, line, module, name)
    done = run_with(folder, CHILD)
    assert done.returncode == 0, done.stderr
    return cast("dict[str, Any]", json.loads(done.stdout))


def soft() -> vi.Mechanism:
    """The forced machine of the copy with a soft stop, which has the same law on both sides."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(1.5, (1.0,)),),
        elements=(vi.SoftStop((1.0,), -1.0, 1.0, stiffness=9.0, law="linear"),),
    )  # fmt: skip


@pytest.mark.slow
def test_a_free_mass_crosses_the_band_and_turns_in_half_a_period_of_the_spring(
    found: dict[str, Any],
) -> None:
    pieces = np.tile([2.0, math.pi / 3.0], 4)
    times = np.cumsum([1.0, *pieces[1:]])
    assert found["time"][: len(times)] == pytest.approx(times, rel=1e-14)
    assert found["states"][:4] == [1, 0, 2, 0]
    assert found["status"][:2] == [vi.Status.ENGAGE, vi.Status.CHANGE]
    assert found["force"] == pytest.approx([0.0, -3.0], abs=1e-12)


@pytest.mark.slow
def test_it_is_stored_in_files_and_read_from_them(found: dict[str, Any]) -> None:
    assert found["restored"] == [True, True]


@pytest.mark.slow
def test_it_is_drawn_with_its_name_its_numbers_and_its_states(found: dict[str, Any]) -> None:
    shown = "\n".join(found["shown"])
    assert "dead band 0: $x_{1}=1$\n$k=9$" in shown
    assert "above the band" in shown
    assert "below the band" in shown


@pytest.mark.slow
def test_its_orbits_are_those_of_a_soft_stop_with_the_same_law(found: dict[str, Any]) -> None:
    orbit = vi.find_orbit(soft(), vi.State((0.0,), (1.0,)))
    branch = vi.continue_orbit(orbit, "elements[0].stiffness", (4.0, 12.0))
    assert found["orbit"][0]
    assert found["orbit"][1] == pytest.approx(np.abs(orbit.multipliers), rel=1e-9)
    assert found["ends"] == pytest.approx([branch.values[0], branch.values[-1]], rel=1e-12)
    assert [label for label, _ in found["special"]] == [p.label for p in branch.special_points]
    for (_, here), there in zip(found["special"], branch.special_points, strict=True):
        assert here == pytest.approx(there.parameter, rel=1e-9)


@pytest.mark.slow
def test_a_sweep_of_it_has_the_motions_of_a_soft_stop(found: dict[str, Any]) -> None:
    swept = vi.sweep(
        soft(), over={"elements[0].upper": [0.8, 1.0]}, start=vi.State((0.0,), (1.0,)), settle_periods=5,
        periods=20, observe="final", progress=False,
    )  # fmt: skip
    assert found["final"] == pytest.approx(swept.final_position.values, abs=1e-10)


@pytest.mark.parametrize("name", sorted(KINDS))
def test_no_other_file_asks_whether_an_element_is_of_a_class(name: str) -> None:
    """The contract says what it is; two exceptions: frictions on one line, rigid stops of a mechanism."""
    kind = KINDS[name].__name__
    asked = re.compile(
        rf"(isinstance|issubclass)\([^\n]*\b{kind}\b|case {kind}\(|type\(\w+\) is {kind}\b"
    )
    files = {
        str(p.relative_to(PACKAGE)) for p in PACKAGE.rglob("*.py") if asked.search(p.read_text())
    }
    assert files <= {"model/elements/friction.py", "model/mechanism.py"}
