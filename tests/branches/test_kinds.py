"""What a kind of special point costs: its record in a table. And users' own kinds, given by a function."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from support.changed_package import PACKAGE, package_copy, run_with

import vibroimpact as vi
from vibroimpact import InvalidParameterError
from vibroimpact.bifurcations.kinds import TWO
from vibroimpact.branches.kinds import ONE

TABLES = {
    "normal_forms/codimension_one.py", "normal_forms/codimension_two.py", "branches/kinds.py",
    "bifurcations/kinds.py", "plotting/branch_looks.py",
}  # fmt: skip
PLANE = ("omega", "half_clearance")
BOUNDS = ((1.05, 1.15), (4.8, 5.2))


def damper(omega: float, half_clearance: float = 5.0) -> vi.ImpactDamper:
    """Paper's set A, where its symmetric orbit is stable."""
    return vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=half_clearance, omega=omega,
    )  # fmt: skip


def too_fast(omega: float, half_clearance: float = 5.0) -> float:
    """Closed form: the particle's velocity after the impact, and 0.74 of the clearance."""
    velocity = vi.symmetric_orbits(damper(omega, half_clearance))[0].state.velocity[1]
    return float(velocity + 0.74 * half_clearance)


def fast(states: Any, _durations: Any, parameters: Any) -> Any:
    """The same as a test function of an orbit."""
    return states[0, 3] + 0.74 * parameters["half_clearance"]


@cache
def branch() -> vi.Branch:
    """Branch on which this function has a zero."""
    start = vi.symmetric_orbits(damper(1.05))[0]
    return vi.continue_orbit(start, "omega", BOUNDS[0], test_functions={"FAST": fast})


@cache
def curve() -> vi.BifurcationCurve:
    """The zero in two parameters."""
    return vi.continue_bifurcation(branch()["FAST1"], PLANE, BOUNDS)


# ---- a user's own test function ------------------------------------------------------------------


def test_a_zero_of_a_users_function_is_a_special_point() -> None:
    point = branch()["FAST1"]
    wanted = brentq(too_fast, *BOUNDS[0], xtol=1e-14)
    assert point.kind == "FAST"
    assert point.parameter == pytest.approx(wanted, abs=1e-11)
    assert point.crossing == np.sign(too_fast(1.15) - too_fast(1.05))
    assert repr(point).endswith(": FAST is zero")
    refused = point.normal_form
    assert "no normal form is known" in refused.reason
    found = vi.switch_branch(point)
    assert isinstance(found, vi.NotFound)


@pytest.mark.slow
def test_it_is_followed_in_two_parameters() -> None:
    found = curve()
    assert found.kind == "FAST"
    assert len(found) > 10
    off = [too_fast(omega, half) for omega, half in found.values]
    assert np.abs(off).max() < 1e-10


def test_a_parameter_that_is_not_followed_is_that_of_the_system() -> None:
    found = vi.continue_bifurcation(
        branch()["FAST1"], ("omega", "restitution"), (BOUNDS[0], (0.79, 0.81))
    )
    omega, restitution = found.values[-1]
    orbit = vi.symmetric_orbits(replace(damper(omega), restitution=restitution))[0]
    assert orbit.state.velocity[1] == pytest.approx(-0.74 * 5.0, abs=1e-10)


def test_a_file_keeps_the_points_without_the_function(tmp_path: Path) -> None:
    vi.save(branch(), tmp_path / "branch.nc")
    loaded = vi.load(tmp_path / "branch.nc")
    point = loaded["FAST1"]
    assert point.parameter == branch()["FAST1"].parameter
    assert "event FAST" not in loaded.family.touches(point.z[None], [point.parameter])
    with pytest.raises(InvalidParameterError, match="is code, which the file does not hold"):
        vi.continue_bifurcation(point, PLANE, BOUNDS)
    vi.save(curve(), tmp_path / "curve.nc")
    there = vi.load(tmp_path / "curve.nc")
    assert there.kind == "FAST"
    assert there.values.tobytes() == curve().values.tobytes()


def test_other_special_points_have_the_same_bits_beside_it() -> None:
    start, wide = vi.symmetric_orbits(damper(0.95))[0], (0.92, 1.02)
    alone = vi.continue_orbit(start, "omega", wide)
    beside = vi.continue_orbit(
        start, "omega", wide, test_functions={"NEVER": lambda _s, _d, p: p["omega"]}
    )
    assert [point.label for point in alone.special_points] == ["NS1", "NS2"]
    assert [p.parameter for p in alone.special_points] == [
        p.parameter for p in beside.special_points
    ]


@pytest.mark.parametrize(
    ("events", "message"),
    [
        ([fast], "a mapping of labels"),
        ({"NS": fast}, "must be a word of letters, none of"),
        ({"FAST1": fast}, "must be a word of letters"),
        ({"FAST": 1.0}, "a function of an orbit"),
        ({"FAST": lambda states: states[0, 0]}, "failed"),
        ({"FAST": lambda _s, _d, parameters: parameters["colour"]}, "colour"),
        ({"FAST": lambda _s, _d, _p: float("nan")}, "must be finite there"),
    ],
)
def test_other_events_are_refused(events: Any, message: str) -> None:
    with pytest.raises(InvalidParameterError, match=message):
        vi.continue_orbit(
            vi.symmetric_orbits(damper(1.05))[0], "omega", BOUNDS[0], test_functions=events
        )


# ---- one record ----------------------------------------------------------------------------------


def test_few_places_outside_the_tables_name_a_kind() -> None:
    named = re.compile(rf'"({"|".join({*ONE, *TWO})})"')
    found = {
        str(path.relative_to(PACKAGE)): len(named.findall(path.read_text()))
        for path in PACKAGE.rglob("*.py")
    }
    outside = {name: count for name, count in found.items() if count and name not in TABLES}
    assert sum(outside.values()) < 40, outside
    assert len(outside) <= 8, outside


RECORD = """def toy(states, _durations, _parameters):
    return states[0, 3] + 3.7


TOY = PointKind("TOY", "toy speed", "toy: the particle leaves with 3.7", function=toy)
ONE = by_label((TOY, """
CHILD = """
import json
import vibroimpact as vi

damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.05)
branch = vi.continue_orbit(vi.symmetric_orbits(damper)[0], "omega", (1.05, 1.15))
curve = vi.continue_bifurcation(branch["TOY1"], ("omega", "half_clearance"), ((1.05, 1.15), (4.8, 5.2)))
vi.save(branch, "branch.nc")
vi.save(curve, "curve.nc")
point, again = vi.load("branch.nc")["TOY1"], vi.load("curve.nc")
legends = [[text.get_text() for text in drawn.plot().get_legend().get_texts()] for drawn in (branch, again)]
print(json.dumps({
    "value": point.parameter, "meaning": repr(point), "curve": again.values.tolist(), "kind": again.kind,
    "legends": legends, "followed": len(vi.continue_bifurcation(point, curve.names, curve.bounds)),
}))
"""


@pytest.mark.slow
def test_a_kind_is_added_by_its_record_and_its_look(tmp_path: Path) -> None:
    package = package_copy(tmp_path)
    for file, before, after in (
        ("branches/kinds.py", "ONE = by_label((", RECORD),
        ("plotting/branch_looks.py", "LOOKS = {", 'LOOKS = {\n    "TOY": Look("H", style.BLUE),'),
    ):
        text = (package / file).read_text()
        assert text.count(before) == 1
        (package / file).write_text(text.replace(before, after))
    done = run_with(tmp_path, CHILD)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)

    def miss(omega: float, half_clearance: float = 5.0) -> float:
        return too_fast(omega, half_clearance) - 0.74 * half_clearance + 3.7

    assert found["value"] == pytest.approx(brentq(miss, 1.05, 1.15, xtol=1e-14), abs=1e-11)
    assert found["meaning"].endswith("toy: the particle leaves with 3.7")
    assert found["kind"] == "TOY"
    assert np.abs([miss(*pair) for pair in found["curve"]]).max() < 1e-10
    assert len(found["curve"]) > 10
    assert found["followed"] == len(found["curve"])
    assert all("toy speed" in legend for legend in found["legends"])
