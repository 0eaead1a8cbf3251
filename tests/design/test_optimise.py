"""Optimised machines against brute force, closed forms, finite differences and each other."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact import plotting
from vibroimpact._core.files import only_writer
from vibroimpact.design import optimise
from vibroimpact.design.objective import judge_of
from vibroimpact.model.parameters import with_parameters
from vibroimpact.plotting import report

DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=1.0, zeta=0.02, restitution=0.6, half_clearance=10.0, omega=1.0
)
QUICK: dict[str, Any] = {"points": 5, "starts": 2, "settle_periods": 100, "periods": 20}
OVER = vi.Objective("omega", (0.98, 1.02), "x1", **QUICK)
CLEARANCE = {"half_clearance": (5.0, 13.0)}
SMOOTH = {
    "half_clearance": (9.5, 10.5)
}  # one orbit, which attracts all starts; the best is at 10.5
PLANE = {"mass_ratio": [0.05, 0.1], "half_clearance": [5.0, 10.0, 15.0, 20.0]}
MU = 0.1


def absorber(nu: float, zeta: float, omega: float = 1.0) -> vi.Mechanism:
    """Den Hartog's linear absorber on an undamped machine of unit mass and stiffness."""
    k, c = MU * nu**2, 2.0 * MU * nu * zeta
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, MU]],
        damping=[[c, -c], [-c, c]],
        stiffness=[[1.0 + k, -k], [-k, k]],
        forces=(vi.Harmonic(omega, (1.0, 0.0)),),
        elements=(vi.RigidStop((-1.0, 1.0), upper=1e6),),
    )


def two_balls(upper: float, lower: float, omega: float = 1.0) -> vi.Mechanism:
    """Two balls in slots with unequal clearances."""
    contacts = tuple(
        vi.RigidStop(row, -lower, upper, restitution=0.6)
        for row in ((-1.0, 1.0, 0.0), (-1.0, 0.0, 1.0))
    )
    return vi.Mechanism(
        mass=np.diag([1.0, 0.04, 0.05]),
        damping=np.diag([0.04, 0.0, 0.0]),
        stiffness=np.diag([1.0, 0.0, 0.0]),
        forces=(vi.Harmonic(omega, (1.0, 0.0, 0.0)),),
        elements=contacts,
    )


@pytest.fixture(scope="module")
def best() -> vi.Design:
    return vi.optimise(DAMPER, CLEARANCE, OVER, budget=64, refine=1, progress=False)


@pytest.fixture(scope="module")
def front() -> vi.ParetoFront:
    over = replace(OVER, bounds=(0.9, 1.1), settle_periods=60.0)
    both = [over, replace(over, measure="impact speed")]
    vary = {"half_clearance": (2.0, 30.0)}
    return vi.pareto_front(DAMPER, vary, both, budget=96, refine=1, progress=False)


@pytest.fixture(scope="module")
def plane() -> vi.DesignMap:
    return vi.design_map(DAMPER, PLANE, OVER, progress=False)


# ---- objectives ----------------------------------------------------------------------------------


def test_an_objective_is_the_worst_of_a_sweep_of_each_machine_alone() -> None:
    o = replace(OVER, spread={"restitution": (0.5, 0.75), "half_clearance": 0.125})
    judge = judge_of(DAMPER, o, ("mass_ratio", "half_clearance"))
    rows = np.array([[0.05, 8.0], [0.1, 12.0]])
    for row, value in zip(rows, judge.values(rows), strict=True):
        worst = 0.0
        for r, part in ((0.625, 1.0), (0.5, 0.875), (0.5, 1.125), (0.75, 0.875), (0.75, 1.125)):
            machine = replace(
                DAMPER, mass_ratio=row[0], half_clearance=part * row[1], restitution=r
            )
            members = vi.sweep(
                machine, over={"omega": np.linspace(0.98, 1.02, 5)}, start=judge.starts, settle_periods=100,
                periods=20, observe=[vi.observe.Extremes(row=(1.0, 0.0))], progress=False,
            )  # fmt: skip
            half = (members["x_largest"] - members["x_smallest"]) / 2.0
            worst = max(worst, float(half.max()))
        assert value == pytest.approx(worst, rel=1e-14)  # the same members, bit for bit


def test_a_mean_is_the_trapezoidal_rule_of_the_closed_form() -> None:
    wide = vi.Objective(
        "omega", (0.8, 1.2), "x1", points=9, starts=1, settle_periods=300, periods=5, kind="mean"
    )
    judge = judge_of(DAMPER, wide, ("half_clearance",))
    w = np.linspace(0.8, 1.2, 9)
    amplitude = 1.0 / np.abs(1.0 - w**2 + 0.04j * w)
    exact = np.trapezoid(amplitude, w) / 0.4
    # the stops are out of reach; what is left of the start after 300 periods is exp(-0.02 300 2 pi)
    assert judge.values(np.array([[1e6]]))[0] == pytest.approx(exact, rel=1e-9)


def test_the_machine_without_impacts_is_worst_at_its_resonance() -> None:
    judge = judge_of(DAMPER, OVER, ("half_clearance",))
    exact = 1.0 / (2.0 * 0.02 * math.sqrt(1.0 - 0.02**2))
    assert judge.without_impacts == pytest.approx(exact, rel=1e-9)


# ---- the optimum ---------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_best_machine_is_not_beaten_by_brute_force(best: vi.Design) -> None:
    grid = np.linspace(5.0, 13.0, 33)
    values = best.judge.values(grid[:, None])
    # the best is where the symmetric orbit ceases to attract all starts: a step between two values
    assert best.value <= values.min()
    assert best.parameters["half_clearance"] == pytest.approx(grid[np.argmin(values)], abs=0.25)


def test_a_machine_that_was_lucky_in_the_search_is_not_the_result(best: vi.Design) -> None:
    levels, worth = np.array(best.search.levels), np.array(best.search.worth)
    table = np.array(best.search.table)[:, 0]
    lucky = table[levels == 1][np.argmin(worth[levels == 1])]  # at the step
    others = replace(OVER, points=17, starts=8, seed=99)  # starts that no judge of the search had
    judge = judge_of(DAMPER, others, ("half_clearance",))
    at = np.array([[lucky], [best.parameters["half_clearance"]]])
    promised, found = worth[levels == 1].min(), judge.values(at)
    assert found[0] > 2.0 * promised
    assert found[1] == pytest.approx(best.value, rel=1e-6)  # motions have settled
    assert best.value == pytest.approx(best.searched, rel=1e-6)
    assert "after 2 further rounds" in best.why_stopped  # each of which is bounded
    assert [(one.objective.points, one.objective.starts) for one in best.search.judges[2:]] == [
        (9, 4), (17, 8), (33, 16)
    ]  # fmt: skip


def test_reduction_is_that_of_the_verified_value(best: vi.Design) -> None:
    exact = 20.0 * math.log10(25.0 / math.sqrt(1.0 - 0.02**2) / best.value)
    assert best.reduction_db == pytest.approx(exact, abs=1e-8)


@pytest.mark.slow
def test_den_hartogs_absorber_is_found() -> None:
    tuned = vi.tuned_damper(MU)
    machine = vi.Family(absorber, nu=1.1, zeta=0.3, omega=1.0)
    over = vi.Objective(
        "omega", (0.75, 1.2), "x1", points=41, starts=1, settle_periods=100, periods=2
    )
    found = vi.optimise(
        machine, {"nu": (0.7, 1.2), "zeta": (0.05, 0.5)}, over, budget=192, refine=1,
        progress=False,
    )  # fmt: skip
    # between two of 41 points a peak is higher than at the nearest by (0.0056 / 0.13)^2 / 2 or less
    assert found.value == pytest.approx(tuned.peak, rel=2e-3)
    damper = vi.TunedDamper(MU, found.parameters["nu"], found.parameters["zeta"])
    for value, points in ((found.searched, 41), (found.value, 81)):
        highest = damper.amplification(np.linspace(0.75, 1.2, points)).max()
        assert value == pytest.approx(highest, rel=1e-6)
    assert found.parameters["nu"] == pytest.approx(tuned.frequency_ratio, rel=5e-3)
    assert found.parameters["zeta"] == pytest.approx(tuned.damping_ratio, rel=5e-2)
    given = vi.TunedDamper(MU, 1.1, 0.3).peak
    exact = 20.0 * math.log10(given / found.value)
    assert found.reduction_db == pytest.approx(exact, abs=1e-7)


def test_the_last_machines_are_judged_with_more_members() -> None:
    found = vi.optimise(DAMPER, SMOOTH, OVER, budget=32, refine=2, progress=False)
    row = np.array([[found.parameters["half_clearance"]]])
    assert found.why_stopped.endswith("; verified")  # at once
    for value, points, starts, seed in ((found.searched, 9, 4, 0), (found.value, 17, 8, 1)):
        finer = replace(OVER, points=points, starts=starts, seed=seed)
        assert value == judge_of(DAMPER, finer, ("half_clearance",)).values(row)[0]


@pytest.mark.slow
def test_two_balls_with_unequal_clearances_are_designed_by_the_same_call() -> None:
    machine = vi.Family(two_balls, upper=10.0, lower=10.0, omega=1.0)
    vary = {"upper": (3.0, 20.0), "lower": (3.0, 20.0)}
    found = vi.optimise(machine, vary, OVER, budget=48, refine=0, progress=False)
    table = np.array([[u, v] for u in (4.0, 9.0, 14.0, 19.0) for v in (4.0, 9.0, 14.0, 19.0)])
    assert found.value < found.judge.values(table).min() * 1.05
    assert found.reduction_db > 6.0


# ---- about the optimum ---------------------------------------------------------------------------


def test_the_exact_sensitivity_is_that_of_the_worst_orbit() -> None:
    over = replace(OVER, bounds=(1.0, 1.02), settle_periods=200.0)
    design = vi.optimise(
        DAMPER, {"half_clearance": (9.0, 9.5), "restitution": (0.5, 0.55)}, over, budget=32,
        refine=1, progress=False,
    )  # fmt: skip
    assert design.sensitivity_exact
    assert [slope.error for slope in design.sensitivity.values()] == [0.0, 0.0]
    orbit = design.worst_motion
    assert isinstance(orbit, vi.Orbit)
    h = 1e-4
    for name, slope in design.sensitivity.items():
        ends = []
        for k in (-1, 1):
            value = getattr(orbit.system, name) + k * h
            near = vi.find_orbit(with_parameters(orbit.system, {name: value}), design.worst.state)
            ends.append(design.judge.measure.of_orbit(near))
        # the third derivative is of the order of the slope; an orbit is exact to some 1e-12
        assert slope.value == pytest.approx((ends[1] - ends[0]) / (2.0 * h), rel=1e-6)
    # and of the objective itself, whose members settle to exp(-0.33 200) and better
    row = np.array(list(design.parameters.values()))
    for i, slope in enumerate(design.sensitivity.values()):
        rows = np.array([row + k * h * np.eye(2)[i] for k in (-1, 1)])
        low, high = design.judge.values(rows)
        assert slope.value == pytest.approx((high - low) / (2.0 * h), rel=1e-5)


def test_a_motion_that_is_not_periodic_has_differences_with_an_error() -> None:
    wide = vi.optimise(
        DAMPER, CLEARANCE, replace(OVER, kind="mean"), budget=32, refine=0, progress=False
    )
    assert not wide.sensitivity_exact
    assert wide.sensitivity["half_clearance"].error > 0.0


def test_the_objective_is_within_a_decibel_over_the_robust_range(best: vi.Design) -> None:
    low, high, to_bounds = best.robust()["half_clearance"]
    at = best.parameters["half_clearance"]
    assert low <= at <= high
    limit = best.value * 10.0**0.05
    tried = [at + part * (end - at) for end in (5.0, 13.0) for part in np.arange(1, 9) / 8]
    inside = [x for x in tried if low <= x <= high]
    if inside:
        assert (best.judge.values(np.array(inside)[:, None]) <= limit).all()
    for end, bound, whole in zip((low, high), (5.0, 13.0), to_bounds, strict=True):
        beyond = end + (bound - at) / 8.0 / 2.0**5
        value = best.judge.values(np.array([[beyond]]))[0]
        assert whole or value > limit


@pytest.mark.slow
def test_an_optimum_at_its_bound_is_said_to_be_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = vi.optimise(DAMPER, SMOOTH, OVER, budget=32, refine=1, progress=False)
    assert found.at_bounds == {"half_clearance": "upper"}
    assert "half_clearance = 10.5, its upper bound" in repr(found)
    for name, value in {"VALUES": 2, "STARTS": 1, "BRANCHES": 0}.items():
        monkeypatch.setattr(optimise, f"REPORT_{name}", value)
    monkeypatch.setattr(report, "TABLE_VALUES", 1)
    found.report(tmp_path / "best.html", progress=False)
    words = (tmp_path / "best.html").read_text(encoding="utf-8")
    assert "The half clearance is at its upper bound" in words
    with pytest.raises(vi.InvalidParameterError, match="html"):
        found.report(tmp_path / "best.pdf")
    assert list(found.to_dataset()["bound"].values) == ["upper"]


@pytest.mark.slow
def test_a_machine_in_si_units_is_designed_in_them_as_the_nondimensional_one() -> None:
    w = 16.0 * math.pi
    frame = vi.ImpactDamper.from_physical(
        M1=120.0, M2=6.0, K=120.0 * w**2, C=4.8 * w, F0=400.0, Omega=w, D=0.02, restitution=0.6
    )
    length = 400.0 / (120.0 * w**2)
    bounds = {"half_clearance": (5.0 * length, 13.0 * length)}
    over = vi.Objective("omega", (7.84, 8.16), "x1", unit="Hz", **QUICK)
    found = vi.optimise(frame, bounds, over, budget=32, refine=0, progress=False)
    light = replace(DAMPER, mass_ratio=0.05)
    plain = vi.optimise(light, CLEARANCE, OVER, budget=32, refine=0, progress=False)
    assert found.judge.band.low == pytest.approx(0.98 * w, rel=1e-14)
    assert found.parameters["half_clearance"] == pytest.approx(
        plain.parameters["half_clearance"] * length, rel=1e-14
    )
    assert found.value == pytest.approx(plain.value * length, rel=1e-6)  # motions have settled
    data = found.to_dataset()
    assert data["half_clearance"].attrs["units"] == "m"
    assert list(data["points"].values) == [5, 9]
    assert float(data["value"][-1].min()) == found.value
    assert float(data["searched_value"]) == found.searched
    assert f"{1e3 * found.value:.6g} mm" in repr(found)


# ---- interruption, resuming, refusals ------------------------------------------------------------


class Stopper:
    """A progress callback that interrupts after so many calls."""

    def __init__(self, calls: int) -> None:
        self.left = calls

    def __call__(self, *_: object) -> None:
        self.left -= 1
        if self.left <= 0:
            raise KeyboardInterrupt


@pytest.mark.parametrize("calls", [3, 6])  # in the search; among the last machines
@pytest.mark.slow
def test_an_interruption_keeps_the_best_so_far_and_resuming_ends_as_if_there_was_none(
    tmp_path: Path, best: vi.Design, calls: int
) -> None:
    store = tmp_path / "search.nc"
    part = vi.optimise(
        DAMPER, CLEARANCE, OVER, budget=64, refine=1, progress=Stopper(calls), store=store
    )
    assert part.interrupted
    assert "interrupted" in part.why_stopped
    verified = 1
    assert part.machines - verified == 48 if calls == 3 else 64 < part.machines < best.machines
    assert part.value == part.judge.values(np.array([[part.parameters["half_clearance"]]]))[0]
    whole = vi.optimise(DAMPER, CLEARANCE, OVER, budget=64, refine=1, progress=False, store=store)
    assert whole.parameters == best.parameters
    assert whole.value == best.value
    assert whole.history == best.history
    with pytest.raises(vi.InvalidParameterError, match="another search"):
        vi.optimise(DAMPER, {"half_clearance": (5.0, 12.0)}, OVER, store=store, progress=False)


def test_a_store_to_which_another_search_writes_is_refused(tmp_path: Path) -> None:
    store = tmp_path / "search.nc"
    with (
        only_writer("store", store),
        pytest.raises(vi.InvalidParameterError, match="another process is writing to it"),
    ):
        vi.optimise(DAMPER, CLEARANCE, OVER, budget=64, refine=1, progress=False, store=store)
    assert not store.exists()


@pytest.mark.parametrize("refine", [0, 1])
@pytest.mark.slow
def test_a_search_that_ends_before_its_store_does_is_as_if_there_was_no_store(
    tmp_path: Path, refine: int
) -> None:
    search: dict[str, Any] = {"refine": refine, "progress": False}
    store = tmp_path / "search.nc"
    longer = vi.optimise(DAMPER, SMOOTH, OVER, **search, budget=64, store=store)
    here = vi.optimise(DAMPER, SMOOTH, OVER, **search, budget=32, store=store)
    alone = vi.optimise(DAMPER, SMOOTH, OVER, **search, budget=32)
    assert here.machines == alone.machines < longer.machines
    assert here.history == alone.history
    assert here.parameters == alone.parameters


def test_constraints_hold_and_those_that_nothing_satisfies_are_named(best: vi.Design) -> None:
    def below_eight(p: dict[str, float]) -> float:
        return 8.0 - p["half_clearance"]

    found = vi.optimise(
        DAMPER, CLEARANCE, OVER, constraints=below_eight, budget=32, refine=1, progress=False
    )
    assert found.parameters["half_clearance"] <= 8.0
    assert found.value > best.value

    def never(p: dict[str, float]) -> float:
        return -p["half_clearance"]

    for search in (vi.optimise, vi.pareto_front):
        objective: Any = OVER if search is vi.optimise else [OVER, OVER]
        with pytest.raises(vi.InvalidParameterError, match="never fails most often"):
            search(
                DAMPER, CLEARANCE, objective, constraints=[below_eight, never], budget=64,
                progress=False,
            )  # fmt: skip


@pytest.mark.parametrize(
    ("bounds", "objective", "message"),
    [
        ({"half_clearance": (5.0, 2.0)}, OVER, "need low < high"),
        ({"half_clearance": (-5.0, 2.0)}, OVER, "half_clearance = -5.0: must be > 0"),
        ({"clearance": (1.0, 2.0)}, OVER, "clearance"),
        ({}, OVER, "bounds = "),
        ({"omega": (1.0, 2.0)}, OVER, "is what the band"),
        (CLEARANCE, replace(OVER, bounds=(-1.0, 1.0)), "omega = -1.0: must be > 0"),
        (CLEARANCE, replace(OVER, measure="x7"), "x7"),
        (CLEARANCE, replace(OVER, spread={"restitution": 0.9}), "restitution = 1.14"),
        (CLEARANCE, replace(OVER, spread={"half_clearance": (1.0, 2.0)}), "relative half"),
        ({"half_clearance": (1e5, 1e6)}, replace(OVER, measure="impact rate"), "does not depend"),
        (CLEARANCE, "x1", "vi.Objective"),
    ],
)
def test_searches_that_mean_nothing_are_refused(bounds: Any, objective: Any, message: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match=message):
        vi.optimise(DAMPER, bounds, objective, budget=32, progress=False)


def test_bands_and_widths_are_refused_before_there_is_a_machine() -> None:
    with pytest.raises(vi.InvalidParameterError, match="need low < high"):
        vi.Objective("omega", (1.2, 1.0), "x1")
    with pytest.raises(vi.InvalidParameterError, match=r"must be in \(0, 1\)"):
        vi.Objective("omega", (1.0, 1.2), "x1", spread={"restitution": 1.5}, kind="mean")
    with pytest.raises(vi.InvalidParameterError, match="aim"):
        vi.Objective("omega", (1.0, 1.2), "x1", aim="less", kind="mean")  # type: ignore[arg-type]


# ---- maps and fronts -----------------------------------------------------------------------------


def test_a_map_holds_the_objective_its_ridge_and_the_region_within_a_decibel(
    plane: vi.DesignMap,
) -> None:
    found, judge = plane, judge_of(DAMPER, OVER, tuple(PLANE))
    alone = judge.values(np.array([[0.1, 15.0]]))[0]
    assert found.value[1, 2] == alone
    assert found.reduction_db[1, 2] == pytest.approx(
        20.0 * math.log10(25.0 / math.sqrt(1.0 - 0.02**2) / alone), abs=1e-8
    )
    data = found.to_dataset()
    first = found.value.argmin(axis=1)
    assert data["best_half_clearance"].values == pytest.approx(
        np.array(PLANE["half_clearance"])[first]
    )
    near = found.value <= found.value.min() * 10.0**0.05
    assert (data["within_1db"].values == near).all()
    place = np.unravel_index(found.value.argmin(), (2, 4))
    assert list(found.best.values()) == [list(PLANE.values())[i][k] for i, k in enumerate(place)]


def test_no_machine_of_a_front_beats_another_and_brute_force_none_of_them(
    front: vi.ParetoFront,
) -> None:
    assert len(front) > 3
    assert (np.diff(front.values[:, 0]) > 0.0).all()
    assert (np.diff(front.values[:, 1]) < 0.0).all()
    table = np.linspace(2.0, 30.0, 29)[:, None]
    apart = np.array([judge.values(table) for judge in front.judges]).T
    for one in apart:  # within 5 %: the front has few machines, and the plane as few others
        assert not (one < 0.95 * front.values).all(axis=1).all()
    again = np.array([judge.values(front.table) for judge in front.judges]).T
    assert (again == front.values).all()


@pytest.mark.slow
def test_designs_are_drawn(
    tmp_path: Path, best: vi.Design, plane: vi.DesignMap, front: vi.ParetoFront
) -> None:
    drawn = [best.plot(), best.plot(what="search"), plane.plot(), front.plot()]
    for number, ax in enumerate(drawn):
        plotting.save(ax, tmp_path / f"{number}.svg")
        mpl.pyplot.close(ax.figure)


def test_machines_without_impacts_are_within_a_decibel_of_each_other() -> None:
    over = replace(OVER, bounds=(1.3, 1.5), measure="impact speed")
    chart = vi.design_map(
        DAMPER, {"mass_ratio": [0.1, 0.2], "half_clearance": [2.0, 3000.0]}, over, progress=False
    )
    assert (chart.value[:, 1] == 0.0).all()
    assert (chart.within == [[False, True], [False, True]]).all()


def test_corners_whose_starts_are_all_behind_a_stop_do_not_hide_the_worst_motion() -> None:
    machine = vi.Mechanism(
        mass=[[1.0]], damping=[[0.02]], stiffness=[[1.0]],
        forces=(vi.Harmonic(1.2, (1.0,)),), elements=(vi.RigidStop((1.0,), upper=0.5),),
    )  # fmt: skip
    over = vi.Objective(
        "omega", (1.1, 1.2), "x1", points=3, starts=1, settle_periods=20, periods=10,
        spread={"elements[0].upper": (-0.3, 0.5)},
    )  # fmt: skip
    judge = judge_of(machine, over, ("damping[0][0]",))
    row = np.array([0.02])
    assert judge.worst(row).value == judge.values(row[None])[0] > 0.0
