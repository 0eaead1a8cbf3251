"""Parameters by name: their values, systems with another value, and exact derivatives."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
import xarray as xr
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.model.parameters import expanded, names_of, parameter_value, with_parameter

EPS = np.finfo(float).eps
DAMPER = paper_damper("A", 1.2)
PLAIN = vi.Mechanism(
    mass=[[1.0, 0.0], [0.0, 0.5]],
    damping=[[0.06, -0.02], [-0.02, 0.02]],
    stiffness=[[2.0, -1.0], [-1.0, 1.0]],
    forces=(vi.Harmonic(1.8, (1.0, 0.5)), vi.Harmonic(2.7, (0.2, 0.0), (0.0, 0.3))),
    elements=(vi.RigidStop((1.0, 0.0), upper=0.4, restitution=0.7),
              vi.RigidStop((-1.0, 1.0), -0.3, 0.2, (0.5, 0.6))),
    constant_force=(0.1, 0.0),
)  # fmt: skip


def swinging(k: float, A: float, phi: float) -> vi.Mechanism:
    """A family whose entries are not polynomials of its parameters."""
    return vi.Mechanism(
        mass=[[np.exp(0.1 * k)]],
        damping=[[0.1 * np.sqrt(k)]],
        stiffness=[[k**1.5 / (1.0 + k)]],
        forces=(vi.Harmonic(np.log(1.0 + k), (A * np.sin(phi),), (A * np.cos(phi),)),),
        elements=(vi.RigidStop((1.0,), upper=1.0 - phi / 7, restitution=abs(0.8 * k / k)),),
    )


FAMILY = vi.Family(swinging, k=1.3, A=2.0, phi=0.4)


# ---- values --------------------------------------------------------------------------------------


def test_values_are_found_by_name_and_by_path() -> None:
    assert parameter_value(DAMPER, "zeta") == 0.045
    assert parameter_value(FAMILY, "A") == 2.0
    values = {
        "omega": 1.8, "mass[1][1]": 0.5, "damping[0][1]": -0.02, "stiffness[1][0]": -1.0,
        "forces[0].sine[1]": 0.5, "forces[1].cosine[1]": 0.3, "forces[1].omega": 2.7,
        "elements[0].upper": 0.4, "elements[1].lower": -0.3, "elements[0].restitution": 0.7,
        "elements[1].restitution[1]": 0.6, "elements[1].row[0]": -1.0, "constant_force[0]": 0.1,
    }  # fmt: skip
    assert {path: parameter_value(PLAIN, path) for path in values} == values


@pytest.mark.parametrize(
    ("system", "name", "value"),
    [
        (DAMPER, "omega", 1.25), (FAMILY, "phi", 0.5), (PLAIN, "omega", 2.0),
        (PLAIN, "stiffness[0][1]", -0.9), (PLAIN, "mass[0][0]", 1.1),
        (PLAIN, "forces[1].sine[0]", 0.25), (PLAIN, "elements[0].restitution", 0.5),
        (PLAIN, "elements[1].restitution[0]", 0.4), (PLAIN, "elements[1].upper", 0.25),
        (PLAIN, "constant_force[1]", 0.2),
    ],
)  # fmt: skip
def test_a_replaced_value_is_read_back_and_nothing_else_changed(
    system: vi.ImpactDamper | vi.Mechanism | vi.Family, name: str, value: float
) -> None:
    there = with_parameter(system, name, value)
    assert parameter_value(there, name) == value
    assert parameter_value(system, name) != value
    assert with_parameter(there, name, parameter_value(system, name)) == system


def test_an_entry_of_a_symmetric_matrix_takes_its_mirror_image_along() -> None:
    there = with_parameter(PLAIN, "stiffness[0][1]", -0.9)
    assert isinstance(there, vi.Mechanism)
    assert np.array_equal(there.stiffness, [[2.0, -0.9], [-0.9, 1.0]])


def test_omega_of_a_mechanism_keeps_the_ratios_of_its_lines() -> None:
    there = with_parameter(PLAIN, "omega", 3.6)
    assert isinstance(there, vi.Mechanism)
    assert [line.omega for line in there.forces] == pytest.approx([3.6, 5.4], rel=EPS)


def test_a_family_is_a_system_like_any_other() -> None:
    assert repr(FAMILY) == "Family(swinging, k=1.3, A=2.0, phi=0.4)"
    direct = vi.simulate(swinging(1.3, 2.0, 0.4), vi.State((0.0,), (0.0,)), impacts=20)
    np.testing.assert_array_equal(
        vi.simulate(FAMILY, vi.State((0.0,), (0.0,)), impacts=20).time, direct.time
    )
    assert vi.Family(swinging, k=1.3, A=2.0, phi=0.4) == FAMILY
    assert hash(FAMILY) == hash(vi.Family(swinging, k=1.3, A=2.0, phi=0.4))


# ---- derivatives ---------------------------------------------------------------------------------


def orders(number: object) -> list[float]:
    """f, f', f'', f''' of an entry that may be a plain number."""
    coefficients = getattr(number, "coefficients", None)
    return [coefficients[k] for k in (0, 1, 3, 7)] if coefficients else [number, 0.0, 0.0, 0.0]  # type: ignore[list-item]


W, Z, MU = DAMPER.omega_n, DAMPER.zeta, DAMPER.mass_ratio
POWERS = {  # entry: value and three derivatives
    "mass": {
        "mass[0][0]": [1.0, 1.0, 0.0, 0.0],
        "mass[1][1]": [MU, MU, 0.0, 0.0],
        "stiffness[0][0]": [W * W, W * W, 0.0, 0.0],
        "damping[0][0]": [2.0 * Z * W, 2.0 * Z * W, 0.0, 0.0],
    },
    "mass_ratio": {"mass[1][1]": [MU, 1.0, 0.0, 0.0]},
    "omega_n": {
        "stiffness[0][0]": [W * W, 2.0 * W, 2.0, 0.0],
        "damping[0][0]": [2.0 * Z * W, 2.0 * Z, 0.0, 0.0],
    },
    "zeta": {"damping[0][0]": [2.0 * Z * W, 2.0 * W, 0.0, 0.0]},
    "restitution": {"elements[0].restitution": [0.8, 1.0, 0.0, 0.0]},
    "half_clearance": {
        "elements[0].upper": [5.0, 1.0, 0.0, 0.0],
        "elements[0].lower": [-5.0, -1.0, 0.0, 0.0],
    },
    "omega": {"forces[0].omega": [1.2, 1.0, 0.0, 0.0]},
    "force": {"forces[0].sine[0]": [1.0, 1.0, 0.0, 0.0]},
}
ENTRIES = sorted({path for entries in POWERS.values() for path in entries})


def entry_of(m: vi.Mechanism, path: str) -> object:
    """The number, or jet, at a path."""
    first, *rest = path.replace("]", "").replace("[", ".").split(".")
    here: object = getattr(m, first)
    for step in rest:
        here = here[int(step)] if step.isdigit() else getattr(here, step)  # type: ignore[index]
    return here[0] if isinstance(here, tuple) else here


def test_every_parameter_of_the_damper_has_its_exact_derivatives() -> None:
    assert set(POWERS) == set(names_of(DAMPER))
    for name, wanted in POWERS.items():
        m = expanded(DAMPER, name)
        for path in ENTRIES:
            got = orders(entry_of(m, path))
            exact = wanted.get(path, [got[0], 0.0, 0.0, 0.0])
            np.testing.assert_allclose(got, exact, rtol=2.0 * EPS, err_msg=f"{path} by {name}")


MP: dict[str, Callable[[object], object]] = {
    "mass[0][0]": lambda k: mpmath.exp(k / 10),
    "damping[0][0]": lambda k: mpmath.sqrt(k) / 10,
    "stiffness[0][0]": lambda k: k ** mpmath.mpf("1.5") / (1 + k),  # type: ignore[operator]
    "forces[0].omega": lambda k: mpmath.log(1 + k),  # type: ignore[operator]
}


@pytest.mark.parametrize("path", MP)
def test_functions_in_a_family_are_differentiated_exactly(path: str) -> None:
    got = orders(entry_of(expanded(FAMILY, "k"), path))
    with mpmath.workdps(40):
        exact = [float(mpmath.diff(MP[path], mpmath.mpf(1.3), n)) for n in range(4)]
    # a handful of operations, each a rounding of terms not much larger than the result
    np.testing.assert_allclose(got, exact, rtol=0.0, atol=20.0 * EPS * max(map(abs, exact)))


def test_sines_and_cosines_in_a_family_are_differentiated_exactly() -> None:
    line = expanded(FAMILY, "phi").forces[0]
    s, c = 2.0 * math.sin(0.4), 2.0 * math.cos(0.4)
    np.testing.assert_allclose(orders(line.sine[0]), [s, c, -s, -c], rtol=4.0 * EPS)
    np.testing.assert_allclose(orders(line.cosine[0]), [c, -s, -c, s], rtol=4.0 * EPS)


def test_omega_of_a_mechanism_is_differentiated_in_every_line() -> None:
    lines = expanded(PLAIN, "omega").forces
    assert orders(lines[0].omega) == pytest.approx([1.8, 1.0, 0.0, 0.0], rel=EPS)
    assert orders(lines[1].omega) == pytest.approx([2.7, 1.5, 0.0, 0.0], rel=2.0 * EPS)


# ---- misuse --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("system", "name", "message"),
    [
        (DAMPER, "mu", "must be one of mass_ratio, omega_n"),
        (DAMPER, "si", "must be one of"),
        (FAMILY, "omega", "must be one of k, A, phi"),
        (PLAIN, "stiffness[0][7]", "no finite number"),
        (PLAIN, "elements[0].lower", "no finite number"),
        (PLAIN, "elements[1].restitution", "0.5 at the lower and 0.6 at the upper stop"),
        (PLAIN, "elements[0]", "no finite number"),
        (PLAIN, "elements[0].upper.real", "no finite number"),
        (PLAIN, "degrees", "no finite number"),
        (PLAIN, "stiffness[-1][0]", "no finite number"),
        (PLAIN, "", "no finite number"),
        (dataclasses.replace(PLAIN, forces=()), "omega", "no finite number"),
    ],
)
def test_a_name_that_is_no_parameter_is_refused_with_what_there_is(
    system: vi.ImpactDamper | vi.Mechanism | vi.Family, name: str, message: str
) -> None:
    for call in (parameter_value, expanded):
        with pytest.raises(vi.InvalidParameterError, match=message):
            call(system, name)
    with pytest.raises(vi.InvalidParameterError, match=message):
        with_parameter(system, name, 1.0)


def test_a_value_out_of_range_is_refused_by_the_system() -> None:
    with pytest.raises(vi.InvalidParameterError, match="restitution"):
        with_parameter(DAMPER, "restitution", 1.5)


def test_a_family_that_cannot_be_differentiated_says_so() -> None:
    def whole(k: float) -> vi.Mechanism:
        return swinging(float(k), 1.0, 0.0)

    with pytest.raises(vi.InvalidParameterError, match="cannot be differentiated"):
        expanded(vi.Family(whole, k=1.3), "k")


def test_a_family_must_build_a_mechanism() -> None:
    with pytest.raises(vi.InvalidParameterError, match="must return a Mechanism"):
        _ = vi.Family(lambda k: k, k=1.0).mechanism  # type: ignore[arg-type, return-value]


class Bare:
    """A system that is no dataclass."""

    mechanism = PLAIN


STILL = vi.State((0.0, 0.0), (0.0, 0.0))
GRID = vi.GridStarts({"x1": [-0.2, 0.0, 0.2]}, STILL)
SHORT: dict[str, Any] = {"settle_periods": 5, "periods": 5, "progress": False}


def test_a_system_without_parameters_by_name_is_refused_where_one_is_varied() -> None:
    with pytest.raises(vi.InvalidParameterError, match=r"a dataclass, or a vi\.Family"):
        parameter_value(Bare(), "omega")
    with pytest.raises(vi.InvalidParameterError, match=r"a dataclass, or a vi\.Family"):
        with_parameter(Bare(), "omega", 1.0)
    with pytest.raises(vi.InvalidParameterError, match=r"a dataclass, or a vi\.Family"):
        vi.sweep(Bare(), over={"omega": [1.7, 1.8]}, start=GRID, **SHORT)


@pytest.mark.parametrize("start", [GRID, vi.RandomStarts(3, 7, {"v2": (-1.0, 1.0)}, STILL)])
def test_a_system_without_parameters_by_name_is_swept_over_its_starts(
    start: vi.GridStarts | vi.RandomStarts,
) -> None:
    asked: dict[str, Any] = {"over": {}, "start": start, "observe": "final", **SHORT}
    xr.testing.assert_equal(vi.sweep(Bare(), **asked), vi.sweep(PLAIN, **asked))


def test_basins_of_a_system_without_parameters_by_name_are_those_of_its_mechanism() -> None:
    over = {"x1": [-0.2, 0.0, 0.2], "v1": [0.0, 0.5]}
    asked: dict[str, Any] = {"over": over, "start": STILL, **SHORT}
    xr.testing.assert_equal(vi.basins(Bare(), **asked), vi.basins(PLAIN, **asked))


def chain(n: int, k: float) -> vi.Mechanism:
    """As many equal oscillators as ``n`` says; the first meets a stop."""
    unit, none = np.eye(n), (0.0,) * (n - 1)
    return vi.Mechanism(
        mass=unit, damping=0.1 * unit, stiffness=k * unit,
        forces=(vi.Harmonic(1.0, (1.0, *none)),),
        elements=(vi.RigidStop((1.0, *none), upper=0.5, restitution=0.8),),
    )  # fmt: skip


@pytest.mark.parametrize("over", [{"n": [2, 3]}, {"n": [2, 3], "k": [1.0, 2.0]}])
def test_a_parameter_that_counts_is_refused_by_name_and_value(over: dict[str, Any]) -> None:
    with pytest.raises(vi.InvalidParameterError, match=r"n=2\.0.*must be an integer") as caught:
        vi.sweep(vi.Family(chain, n=2, k=1), over=over, start=STILL, **SHORT)
    assert isinstance(caught.value.__cause__, TypeError)


def test_values_that_a_family_refuses_are_named() -> None:
    def weighed(m: float) -> vi.Mechanism:
        stop = vi.RigidStop((1.0,), upper=0.5, restitution=0.8)
        return vi.Mechanism(mass=[[m]], damping=[[0.1]], stiffness=[[1.0]], elements=(stop,))

    system, start = vi.Family(weighed, m=1.0), vi.State((0.0,), (0.0,))
    with pytest.raises(vi.InvalidParameterError, match=r"\(weighed, m=-1\.0\): mass: must be pos"):
        vi.sweep(system, over={"m": [1.0, -1.0, 2.0]}, start=start, **SHORT)


def test_other_errors_of_the_code_that_builds_are_its_own() -> None:
    with pytest.raises(TypeError, match="unsupported operand") as caught:
        _ = vi.Family(lambda k: k + None, k=1.0).mechanism
    assert not isinstance(caught.value, vi.InvalidParameterError)


def test_a_whole_number_that_does_not_count_is_swept() -> None:
    over = {"k": [1, 2]}
    found = vi.sweep(vi.Family(chain, n=2, k=1), over=over, start=STILL, observe="final", **SHORT)
    for k in over["k"]:
        alone = vi.sweep(chain(2, k), over={}, start=GRID, observe="final", **SHORT)
        there = found.final_position.sel(k=k).values
        np.testing.assert_array_equal(there, alone.final_position.sel(x1=0.0).values)


@pytest.mark.parametrize("name", ["start", "x1"])
def test_a_parameter_with_the_name_of_a_start_is_refused(name: str) -> None:
    def named(**values: float) -> vi.Mechanism:
        return chain(2, *values.values())

    starts = vi.RandomStarts(3, 7, {"x1": (-0.2, 0.2)}, STILL)
    with pytest.raises(vi.InvalidParameterError, match=f"'{name}'.*Rename the parameter"):
        vi.sweep(vi.Family(named, **{name: 1.0}), over={name: [1.0, 2.0]}, start=starts, **SHORT)


# ---- elements ------------------------------------------------------------------------------------

MOVED = vi.Mechanism(
    mass=[[1.0, 0.0], [0.0, 0.5]],
    damping=[[0.1, 0.3], [-0.3, 0.1]],
    stiffness=[[2.0, -1.0], [-1.0, 1.0]],
    forces=(vi.Harmonic(1.8, (1.0, 0.5)),),
    elements=(
        vi.RigidStop((1.0, 0.0), upper=0.4, motion=vi.Harmonic(1.8, (0.1,), (0.2,))),
        vi.SoftStop((1.0, -1.0), -0.2, 0.3, stiffness=(20.0, 30.0), damping=0.4,
                    motion=(vi.Harmonic(1.8, (0.05,)), vi.Harmonic(3.6, (0.02,)))),
        vi.Friction((0.0, 1.0), 0.2, belt_speed=0.7, motion=vi.Harmonic(2.7, (0.1,))),
        vi.Friction((1.0, 0.0), 0.2, 0.3),
    ),
)  # fmt: skip
OF_ELEMENTS = {
    "elements[1].stiffness[0]": 20.0, "elements[1].stiffness[1]": 30.0, "elements[1].damping": 0.4,
    "elements[1].lower": -0.2, "elements[1].upper": 0.3, "elements[1].row[1]": -1.0,
    "elements[1].motion[1].sine[0]": 0.02, "elements[2].kinetic": 0.2, "elements[2].static": 0.2,
    "elements[2].belt_speed": 0.7, "elements[2].motion[0].cosine[0]": 0.0,
    "elements[3].static": 0.3, "elements[0].motion[0].sine[0]": 0.1,
    "elements[0].motion[0].cosine[0]": 0.2, "elements[2].motion[0].omega": 2.7,
}  # fmt: skip


def test_values_of_elements_are_found_by_path() -> None:
    assert {path: parameter_value(MOVED, path) for path in OF_ELEMENTS} == OF_ELEMENTS


@pytest.mark.parametrize("path", OF_ELEMENTS)
def test_a_replaced_value_of_an_element_is_read_back_and_nothing_else_changed(path: str) -> None:
    there = with_parameter(MOVED, path, OF_ELEMENTS[path] + 0.01)
    assert parameter_value(there, path) == OF_ELEMENTS[path] + 0.01
    assert with_parameter(there, path, OF_ELEMENTS[path]) == MOVED


@pytest.mark.parametrize("path", OF_ELEMENTS)
def test_a_value_of_an_element_is_differentiated(path: str) -> None:
    here: Any = expanded(MOVED, path)
    for step in path.replace("]", "").replace("[", ".").split("."):
        here = here[int(step)] if step.isdigit() else getattr(here, step)
    here = here[0] if isinstance(here, tuple) else here
    assert orders(here) == [OF_ELEMENTS[path], 1.0, 0.0, 0.0]


def frequencies(m: vi.Mechanism) -> list[float]:
    """Of the lines, of the stop, of the two motions of the soft stop, of the belt."""
    soft, belt = m.switching[0], m.switching[1]
    motions = (*m.rigid_stops[0].motion, *soft.motion, *belt.motion)
    return [line.omega for line in (*m.forces, *motions)]


def test_omega_scales_motions_of_stops_and_belts_with_the_forces() -> None:
    there = with_parameter(MOVED, "omega", 3.6)
    assert isinstance(there, vi.Mechanism)
    assert frequencies(MOVED) == [1.8, 3.6, 2.7, 1.8, 1.8, 3.6, 2.7]
    assert frequencies(there) == [3.6, 7.2, 5.4, 3.6, 3.6, 7.2, 5.4]
    lines = expanded(MOVED, "omega").forces
    for line in (expanded(MOVED, "omega").switching[0].motion[1], lines[1]):
        assert orders(line.omega) == [3.6, 2.0, 0.0, 0.0]


@pytest.mark.parametrize(
    "path", ["forces[1].omega", "elements[1].motion[1].omega"], ids=["force", "motion"]
)
def test_a_frequency_belongs_to_its_line_and_changes_wherever_that_is(path: str) -> None:
    there = with_parameter(MOVED, path, 4.0)
    assert isinstance(there, vi.Mechanism)
    assert frequencies(there) == [1.8, 4.0, 2.7, 1.8, 1.8, 4.0, 2.7]


def test_a_moved_mechanism_is_the_one_that_is_built_with_the_frequency() -> None:
    def built(w: float) -> vi.Mechanism:
        stop = vi.SoftStop((1.0,), upper=0.2, stiffness=9.0, motion=vi.Harmonic(w, (0.3,)))
        return vi.Mechanism(
            mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(w, (0.5,)),),
            elements=(stop,),
        )  # fmt: skip

    there = with_parameter(built(1.0), "omega", 1.3)
    assert there == built(1.3)
    start = vi.State((0.0,), (0.0,))
    runs = [vi.simulate(m, start, impacts=10).time for m in (there, built(1.3))]
    np.testing.assert_array_equal(*runs)


def test_an_entry_of_a_matrix_that_is_not_symmetric_has_no_mirror_image() -> None:
    there = with_parameter(MOVED, "damping[0][1]", 0.4)
    assert isinstance(there, vi.Mechanism)
    assert np.array_equal(there.damping, [[0.1, 0.4], [-0.3, 0.1]])


def test_kinetic_takes_an_equal_static_level_along() -> None:
    both = with_parameter(MOVED, "elements[2].kinetic", 0.5)
    assert parameter_value(both, "elements[2].static") == 0.5
    apart = with_parameter(MOVED, "elements[3].kinetic", 0.1)
    assert parameter_value(apart, "elements[3].static") == 0.3
    with pytest.raises(vi.InvalidParameterError, match=r"static = 0\.3: must be >= kinetic"):
        with_parameter(MOVED, "elements[3].kinetic", 0.4)


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("elements[1].stiffness", r"20\.0 at the lower and 30\.0 at the upper stop\. Take"),
        ("elements[1].law", "no finite number.*elements.0..upper"),
        ("elements[5].kinetic", "no finite number"),
        ("elements[1].states", "no finite number"),
        ("elements[0].motion[1].sine[0]", "no finite number"),
    ],
)
def test_a_path_into_an_element_that_is_no_number_is_refused(path: str, message: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match=message):
        with_parameter(MOVED, path, 1.0)
