"""Systems compiled together: the bits of each alone, and refusals that name the system."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from support.families import CHAIN, FAMILY, PAIR, bits, compiled, swinging
from support.systems import paper_damper, random_mechanism

import vibroimpact as vi
from vibroimpact import _kernel
from vibroimpact._core.columns import Split
from vibroimpact.compile import hybrid
from vibroimpact.compile import many_systems as compiling
from vibroimpact.model.parameters import with_parameters
from vibroimpact.model.system import System, mechanism_of

Values = dict[str, np.ndarray]
DAMPER = paper_damper("A", 1.1)


# ---- compiled together ---------------------------------------------------------------------------


class Recorder:
    """Stands for the kernel's System and keeps what it is given."""

    def __init__(self, **system: Any) -> None:
        self.system, self.modes = system, list[dict[str, Any]]()
        self.resets = list[Any]()

    def add_reset(self, matrix: Any, shift: Any) -> None:
        self.resets.append((matrix, shift))

    def add_mode(self, **mode: Any) -> None:
        self.modes.append(mode)


def recorded(system: System, codes: tuple[int, ...] = ()) -> Recorder:
    """What one system hands to the kernel."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_kernel, "System", Recorder)
        found: Any = hybrid.Compiled(mechanism_of(system))
    for code in codes:
        found.add_code(code)
    kernel: Recorder = found.kernel
    return kernel


def given_alone(kernel: Recorder) -> dict[str, Any]:
    """Every number of it, by name."""
    s, out = kernel.system, dict[str, Any]()
    out |= {"omegas": s["omegas"], "kappas": s["kappas"], "steps": s["step"]}
    out |= {name: [law[i] for law in s["laws"]] for i, name in enumerate(LAW)}
    out["restitution"] = [law[3:] for law in s["laws"]]
    out["reset_matrix"] = [matrix for matrix, _ in kernel.resets]
    out["reset_shift"] = [shift for _, shift in kernel.resets]
    for mode in kernel.modes:
        flow = dict(mode["flow"])
        parts = {name: [guard[i] for guard in mode["guards"]] for i, name in enumerate(GUARD)}
        parts |= {name: mode[name] for name in MAPS}
        if "step" in flow:  # of a mode with elements
            parts |= {"mode_step": flow.pop("step"), "map_shift": mode["shift"]}
            parts |= {name: [one[i] for one in mode["watches"]] for i, name in enumerate(WATCH)}
        parts |= flow
        out |= {f"{mode['code']} {name}": part for name, part in parts.items()}
    return out


LAW, GUARD = ("impulse", "mobility", "shift"), ("rows", "gains", "lower", "upper", "side")
WATCH = (
    "watch_rows", "watch_gains", "watch_lower", "watch_upper", "watch_element", "watch_held",
    "watch_reset", "watch_target",
)  # fmt: skip
MAPS = ("to_x", "to_v", "offset", "from_x", "from_v", "particular")


def given_together(tables: Any, k: int) -> dict[str, Any]:
    """The same for row k of the arrays."""
    out = {name: array[k] for name, array in tables.systems.items()}
    for mode in tables.modes:
        more = {name: x for name, x in mode["piecewise"].items() if name != "element_rows"}
        parts = mode["flow"] | {name: mode[name] for name in (*GUARD, *MAPS) if name != "side"}
        parts |= {name: x for name, x in more.items() if name not in WATCH[4:]}
        out |= {f"{mode['code']} {name}": part[k] for name, part in parts.items()}
        out |= {f"{mode['code']} {name}": more[name] for name in WATCH[4:] if name in more}
        out[f"{mode['code']} side"] = mode["side"]
    return out


def check_equal_bits(system: System, values: Values, codes: tuple[int, ...] = ()) -> None:
    """Every system of a batch against the same system alone."""
    seen = list[int]()
    for systems, tables in compiled(system, values, codes):
        for row, k in enumerate(systems):
            one = with_parameters(system, {name: float(x[k]) for name, x in values.items()})
            kernel = recorded(one, codes)
            assert tables.dense == kernel.system["dense"]
            assert tables.mixed == kernel.system["mixed"]
            alone, together = given_alone(kernel), given_together(tables, row)
            alone["damping"] = mechanism_of(one).damping  # which observers take
            assert alone.keys() == together.keys()
            for name, part in alone.items():
                assert bits(part) == bits(together[name]), (name, k)
            seen.append(int(k))
    assert sorted(seen) == list(range(len(next(iter(values.values())))))


TWO = replace(CHAIN, elements=(vi.RigidStop((1.0, 0.0, 0.0), upper=0.4, restitution=0.7),
                               vi.RigidStop((0.0, -1.0, 1.0), -0.3, 0.2)))  # fmt: skip


def coupled(k: float) -> vi.Mechanism:
    """Two equal masses, joined by a spring or alone."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 1.0]], damping=[[0.0] * 2] * 2,
        stiffness=[[1.0 + k, -k], [-k, 1.0 + k]],
        elements=(vi.RigidStop((-1.0, 1.0), upper=0.5, restitution=0.8),),
    )  # fmt: skip


def rubbing(k: float, kinetic: float, omega: float, lower: float) -> vi.Mechanism:
    """Soft stops that move, friction on a belt, and a rigid stop."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.7]], damping=[[0.1, 0.2], [-0.2, 0.05]],
        stiffness=[[2.0, -1.0], [-1.0, 1.0]],
        forces=(vi.Harmonic(0.9, (0.8, 0.0)), vi.Harmonic(omega, (0.0, 0.1))),
        elements=(
            vi.RigidStop((0.0, 1.0), upper=0.6, restitution=0.2),
            vi.SoftStop((1.0, -1.0), lower, 0.5, stiffness=k, damping=(0.4, k / 30.0),
                        motion=vi.Harmonic(omega, (0.1,))),
            vi.Friction((1.0, 0.0), kinetic, 2.0 * kinetic, belt_speed=kinetic / 3.0),
        ),
    )  # fmt: skip


def grid(**axes: Any) -> Values:
    """Every combination of values, the last one varying fastest."""
    mesh = np.meshgrid(*axes.values(), indexing="ij")
    return dict(zip(axes, (part.ravel() for part in mesh), strict=True))


FULL = random_mechanism(np.random.default_rng(5), 3, lines=2)
PUSHED = replace(random_mechanism(np.random.default_rng(6), 3, contacts=2),
                 constant_force=(0.1, 0.2, -0.1))  # fmt: skip
LOOSE = replace(random_mechanism(np.random.default_rng(5), 3, lines=2, stiff_rank=2),
                constant_force=(0.1, 0.0, 0.0))  # fmt: skip
RNG = np.random.default_rng(4)
U = RNG.uniform
CASES: dict[str, tuple[System, Values]] = {
    "plane": (DAMPER, {"omega": U(0.5, 1.5, 12), "half_clearance": U(1.0, 10.0, 12)}),
    "grid": (DAMPER, grid(omega=U(0.5, 1.5, 4), zeta=U(0.0, 1.5, 3), half_clearance=[1.0, 2.0])),
    "damper": (DAMPER, {"mass_ratio": U(0.01, 1.0, 12), "omega_n": U(0.1, 2.0, 12),
                        "zeta": U(0.0, 1.5, 12)}),
    "modes of three masses": (CHAIN, {"stiffness[0][0]": U(1.5, 3.0, 12)}),
    "two contacts": (TWO, {"stiffness[1][1]": U(2.0, 3.0, 8), "elements[0].upper": U(0.1, 1.0, 8)}),
    "coupled": (FULL, {"stiffness[0][0]": FULL.stiffness[0][0] + U(0.0, 1.0, 12)}),
    "coupled grid": (PUSHED, grid(**{"stiffness[1][1]": PUSHED.stiffness[1][1] + U(0.0, 1.0, 3),
                                     "damping[0][0]": U(0.5, 9.0, 4), "omega": [0.7, 1.1]})),
    "dense": (LOOSE, {"damping[0][0]": LOOSE.damping[0][0] + U(0.0, 1.0, 12)}),
    "every line": (CHAIN, {"omega": U(0.5, 1.2, 12)}),
    "family": (FAMILY, {"k": U(1.0, 2.0, 12), "A": U(0.5, 2.0, 12), "phi": U(-1.0, 1.0, 12)}),
    "coupled or not": (vi.Family(coupled, k=1.0), {"k": np.array([0.0, 0.5, 1.0, 0.0])}),
    "elements": (vi.Family(rubbing, k=9.0, kinetic=0.1, omega=1.3, lower=-0.5),
                 {"k": U(5.0, 20.0, 8), "kinetic": U(0.05, 0.2, 8), "omega": U(1.0, 1.5, 8),
                  "lower": U(-0.9, -0.3, 8)}),
    "nothing varies": (DAMPER, {"omega": np.full(3, 1.1)}),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_systems_compiled_together_have_the_bits_of_each_alone(name: str) -> None:
    check_equal_bits(*CASES[name])


@pytest.mark.parametrize("name", CASES)
def test_ordinary_systems_are_compiled_at_one_go(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither one by one nor split: a branch where they would part has a form for columns."""

    def never(*_: object) -> None:
        pytest.fail("systems were taken apart")

    monkeypatch.setattr(compiling, "_alone", never)
    monkeypatch.setattr(Split, "__init__", never)
    assert len(compiled(*CASES[name])) == 1


RATES = st.sampled_from([0.0, 1e-9, 0.5, 1.0, math.nextafter(1.0, 2.0)]) | st.floats(0.0, 2.0)
SPECIAL = st.tuples(
    st.sampled_from([1.0, 0.5, 2.0]) | st.floats(0.01, 1.0),  # mass_ratio
    RATES,  # omega_n
    st.sampled_from([0.0, 1e-18, 1.0]) | st.floats(0.0, 2.0),  # zeta
    st.sampled_from([1.0, 0.5]) | st.floats(0.1, 2.0),  # omega
)
NAMES = ("mass_ratio", "omega_n", "zeta", "omega")


@settings(max_examples=60, deadline=None)
@given(st.lists(SPECIAL, min_size=2, max_size=6))
@example([(0.1, 0.0, 0.0, 1.0), (0.1, 1.0, 0.0, 0.5), (0.1, 0.0, 0.1, 1.0), (0.1, 1.0, 0.5, 1.0)])
@example([(0.1, 1.0, 0.0, 1.0), (0.1, 0.5, 0.1, 1.0)])
@example([(0.1, 1.0, 0.0, 1.0), (0.1, 0.5, 0.0, 0.5)])
def test_free_undamped_and_resonant_dampers_are_as_alone(systems: list[tuple[float, ...]]) -> None:
    check_equal_bits(DAMPER, dict(zip(NAMES, np.array(systems).T, strict=True)))


COUPLED = st.tuples(
    st.sampled_from([0.0, 1.0, 1e-17]) | st.floats(0.0, 1.0),  # spring between the masses
    st.sampled_from([0.0, 0.1, 1e-18]) | st.floats(0.0, 0.3),  # dashpot between the masses
    st.sampled_from([0.0, 0.05]),  # dashpot of the second mass: not classical
    st.sampled_from([1.0, 2.0]) | st.floats(0.5, 2.0),  # second mass: 1.0 makes frequencies equal
)


@settings(max_examples=40, deadline=None)
@given(st.lists(COUPLED, min_size=2, max_size=6))
@example([(0.0, 0.0, 0.0, 1.0), (1.0, 0.1, 0.0, 1.0), (1.0, 0.1, 0.0, 2.0), (0.0, 0.1, 0.05, 1.0)])
def test_equal_frequencies_and_any_damping_are_as_alone(systems: list[tuple[float, ...]]) -> None:
    check_equal_bits(PAIR, dict(zip(("k", "c", "d", "m"), np.array(systems).T, strict=True)))


def test_systems_without_forcing_are_as_alone() -> None:
    def ball(g: float, gap: float) -> vi.Mechanism:
        return vi.Mechanism(
            mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-g,),
            elements=(vi.RigidStop((1.0,), 0.0, gap, 0.8),),
        )  # fmt: skip

    values = {"g": np.array([9.8, 0.0, 1.0, 2.0]), "gap": np.array([1.0, 2.0, 0.5, 1e-3])}
    check_equal_bits(vi.Family(ball, g=1.0, gap=1.0), values)


def test_a_grid_is_found_by_its_bits_alone() -> None:
    """0.0 and -0.0 are two numbers: their powers and quotients differ."""
    axes = [np.array([1.0, 2.0]), np.array([0.0, -0.0, 1.0])]
    arrays = [part.ravel() for part in np.meshgrid(*axes, indexing="ij")]
    parts, sizes = compiling.spread(arrays)
    assert sizes == (2, 3)
    assert [bits(part) for part in parts] == [bits(axis) for axis in axes]
    assert [part.shape for part in parts] == [(2, 1), (1, 3)]
    arrays[1][4] = 0.0
    assert compiling.spread(arrays)[1] == (6,)
    assert compiling.spread([x[:5] for x in arrays])[1] == (5,)


# ---- paths ---------------------------------------------------------------------------------------


def test_systems_that_branch_apart_are_compiled_in_parts() -> None:
    """Undamped, classically damped, and neither: the last shows positions in another way."""
    values = {"c": np.array([0.0, 0.1, 0.2, 0.0]), "m": np.array([1.0, 1.0, 2.0, 2.0])}
    parts = compiled(PAIR, values)
    found = sorted((k, tables.mixed) for systems, tables in parts for k in systems)
    assert found == [(0, False), (1, False), (2, True), (3, False)]
    check_equal_bits(PAIR, values)


def test_a_grid_is_taken_apart_where_its_systems_branch() -> None:
    check_equal_bits(PAIR, grid(c=[0.0, 0.1, 0.2], d=[0.0, 0.1], m=[1.0, 2.0]))
    check_equal_bits(DAMPER, grid(omega=[0.4, 0.5, 0.6], omega_n=[0.5, 0.0, 0.6], zeta=[0.0, 1.0]))


def test_a_stop_beyond_reach_for_some_systems_is_another_structure() -> None:
    def wall(gap: float) -> vi.Mechanism:
        return vi.Mechanism(
            mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]],
            elements=(vi.RigidStop((1.0,), -1.0, 1.0 / gap if gap > 0.0 else math.inf, 0.8),),
        )  # fmt: skip

    system, values = vi.Family(wall, gap=1.0), {"gap": np.array([1.0, 0.0, 2.0])}
    parts = compiled(system, values)
    codes = [[mode["code"] for mode in tables.modes] for _, tables in parts]
    assert sorted(codes) == [[0, 1, 2], [0, 2]]
    check_equal_bits(system, values)


def test_code_beyond_columns_is_compiled_one_by_one() -> None:
    def rooted(k: float) -> vi.Mechanism:
        return swinging(math.sqrt(k), 2.0, 0.4)

    check_equal_bits(vi.Family(rooted, k=1.0), {"k": np.array([1.0, 2.0, 3.0])})


def test_modes_wanted_later_have_the_bits_of_each_alone() -> None:
    three = random_mechanism(np.random.default_rng(8), 4, contacts=3)
    k = three.stiffness[0][0]
    check_equal_bits(three, {"stiffness[0][0]": np.array([k, k + 0.5, k + 1.0])}, (1, 2 + 3, 18))


def test_rayleighs_damping_of_many_contacts_is_as_alone() -> None:
    """In vibration modes, also those of closed sets; a dashpot couples them."""
    base = random_mechanism(np.random.default_rng(9), 4, contacts=4, lines=1)
    mass, stiffness = np.array(base.mass, dtype=object), np.array(base.stiffness, dtype=object)

    def damped(a: float, b: float, extra: float) -> vi.Mechanism:
        damping = a * mass + b * stiffness
        damping[2, 2] = damping[2, 2] + extra
        return replace(base, damping=damping.tolist())

    values = grid(a=[0.0, 0.1], b=[0.0, 0.03, 0.05], extra=[0.0, 0.01])
    system = vi.Family(damped, a=0.0, b=0.0, extra=0.0)
    mixed = {
        bool(values["extra"][k]): tables.mixed
        for systems, tables in compiled(system, values)
        for k in systems
    }
    assert mixed == {False: False, True: True}
    check_equal_bits(system, values, (1, 2 + 3 + 54))


@pytest.mark.parametrize("seed", range(10))
def test_stiffness_in_proportion_to_the_mass_is_as_alone(seed: int) -> None:
    """Some of the systems need rotations that others do not, of matrices not quite symmetric."""
    base = random_mechanism(np.random.default_rng(seed), 4)
    none = [[0.0] * 4] * 4

    def equal(low: float) -> vi.Mechanism:
        stiffness = 2.0 * np.array(base.mass, dtype=object)
        stiffness[0, 0] = stiffness[0, 0] + low
        return replace(base, damping=none, stiffness=stiffness.tolist())

    check_equal_bits(vi.Family(equal, low=0.0), {"low": np.array([0.0, 2.0])})


# ---- refusals ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"omega": [1.0, -0.5, 1.2], "zeta": [0.1, 0.2, 0.3]},
         r"omega = -0\.5: must be > 0.*System: omega = -0\.5, zeta = 0\.2\."),
        ({"half_clearance": [1.0, 2.0, math.nan]},
         r"half_clearance = nan: must be a finite.*System: half_clearance = nan\."),
        ({"mu": [1.0, 2.0]}, r"'mu': must be one of"),
    ],
)  # fmt: skip
def test_a_refused_system_is_named_with_the_value(
    values: dict[str, list[float]], message: str
) -> None:
    arrays = {name: np.array(x) for name, x in values.items()}
    with pytest.raises(vi.InvalidParameterError, match=message):
        compiled(DAMPER, arrays)


def test_a_system_whose_code_fails_is_named() -> None:
    def picky(k: float) -> vi.Mechanism:
        return swinging(1.0 / (k - 2.0), 2.0, 0.4)

    with pytest.raises(vi.InvalidParameterError, match=r"ZeroDivisionError.*System: k = 2\.0\."):
        compiled(vi.Family(picky, k=3.0), {"k": np.array([3.0, 2.0, 4.0])})


def test_a_mistake_in_compiling_is_no_refusal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compiling one by one would hide it, at many times the cost."""

    def mistaken(*_: object) -> None:
        raise TypeError("a mistake")

    monkeypatch.setattr(compiling, "stacks_of", mistaken)
    with pytest.raises(TypeError, match="a mistake"):
        compiled(DAMPER, {"omega": np.array([1.0, 1.1])})
