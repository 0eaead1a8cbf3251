"""Members of ensembles: how they end, equal bits everywhere, options and variables."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support import UNIT
from support.members import Case, alone_like, beating, cases, chain, run
from support.systems import ball, paper_damper

import vibroimpact as vi
from vibroimpact.compile.many_systems import compile_together
from vibroimpact.sweeps.execution import batch as execution
from vibroimpact.sweeps.execution.batch import batch_of
from vibroimpact.sweeps.member_status import MemberStatus
from vibroimpact.sweeps.observers import (
    Extremes,
    Final,
    Harmonic,
    Rms,
    Rotation,
    Section,
    Settling,
    Symbol,
)
from vibroimpact.sweeps.observers.selection import describe, observer_of, resolve, variables_of
from vibroimpact.sweeps.observers.table import OBSERVERS

CASES = cases()

# The stop B is one that every system here has.
AT_B = (Section(stop="B"), Rotation(stop="B"))
EVERYTHING = (*AT_B, *(name for name in OBSERVERS if name not in ("section", "rotation")))
UNFORCED = tuple(name for name in EVERYTHING if name not in ("stroboscopic", "harmonic"))


def all_of(system: Any) -> tuple[Any, ...]:
    """The observers that a system can have."""
    mechanism = system if isinstance(system, vi.Mechanism) else system.mechanism
    return EVERYTHING if mechanism.forces else UNFORCED


def test_a_start_behind_a_stop_is_an_outcome_without_results() -> None:
    behind = vi.State((0.0, 5.1), (0.0, 0.0))
    case = Case(paper_damper("A", 1.2), behind, 500.0, 200.0)
    found = case.member(*EVERYTHING)
    assert found["end"] == MemberStatus.INITIAL_PENETRATION
    assert found["time"] == 0.0
    for name in ("lyapunov", "impacts_a", "power", "speed_mean", "settling", "x_mean"):
        assert np.isnan(found[name]).all()
    assert found["n"] == found["p"] == found["q"] == found["chatters"] == 0


@pytest.mark.parametrize("most", [3, 30])  # while it settles, within the window
def test_a_member_capped_has_its_last_state_and_no_results(most: int) -> None:
    case = replace(CASES["chaotic"], settle=20.0)
    found = case.member(*EVERYTHING, most_impacts=most)
    record = vi.simulate(case.system, case.state, impacts=most)
    assert found["end"] == MemberStatus.MAX_IMPACTS
    assert found["time"] == record.time[-1]
    assert (found["time"] > case.settle) == (most == 30)
    np.testing.assert_array_equal(found["final_position"], record.position[-1])
    for name, values in found.items():
        if name in ("end", "time") or name.startswith("final"):
            continue
        none = np.isnan(values) if values.dtype.kind == "f" else values == 0
        assert np.all(none), name


@pytest.mark.parametrize(
    ("case", "rest"),
    [
        (Case(ball(0.5), vi.State((1.0,), (0.0,)), 5.0, 1e4), 1.0),  # on the floor for ever
        (Case(ball(0.0), vi.State((0.0,), (0.0,)), 0.0, 1e4), 1.0),  # from the start
        (Case(beating()[0], vi.State((0.0,), (0.0,)), 0.0, 100.0), 0.0),  # never near a stop
    ],
)
def test_a_motion_without_impacts_is_a_result(case: Case, rest: float) -> None:
    found = case.member(*all_of(case.system))
    assert found["end"] == MemberStatus.OK
    assert found["time"] == case.settle + case.observe
    assert found["share_at_rest"] == rest
    assert found["n"] == found["p"] == found["q"] == 0
    assert found["power"] == 0.0
    assert np.isnan(found["speed_mean"])
    assert np.isnan(found["section_time"]).all()
    assert np.isnan(found["rotation"])
    assert np.isnan(found["rotation_error"])
    assert np.isfinite(found["x_rms"]).all()
    assert not found["lyapunov"] > 0.0  # NaN, or -inf at rest


def test_a_mode_that_nobody_built_ends_a_member_as_missing() -> None:
    from vibroimpact import _kernel

    class FreeOnly:
        def __init__(self, **system: Any) -> None:
            self.batch = _kernel.Batch(**system)

        def add_mode(self, **mode: Any) -> None:
            if mode["code"] == 0:
                self.batch.add_mode(**mode)

    case = CASES["chatter"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vibroimpact.compile.tables._kernel", type("", (), {"Batch": FreeOnly}))
        ((part, _),) = compile_together(case.system, {}).inside(slice(0, 1))
        kernel: Any = part.kernel
    found = kernel.batch.run(
        system=np.zeros(1, np.int32), position=np.zeros((1, 2)), velocity=np.array([[0.0, 1.0]]),
        phases=np.zeros((1, 1)), settle=np.zeros(1), observe=np.full(1, 500.0),
        most_impacts=10_000, observers={},
    )  # fmt: skip
    assert found["end"] == [MemberStatus.MISSING]
    assert 0.0 < found["time"][0] < 500.0


def test_ctrl_c_ends_a_run_of_members(monkeypatch: pytest.MonkeyPatch) -> None:
    import _thread
    import signal
    import threading

    case = replace(CASES["chaotic"], observe=1e8)  # a minute
    begun, run_part = threading.Event(), execution._run_part

    def seen(*arguments: Any) -> Any:
        begun.set()
        return run_part(*arguments)

    def interrupt() -> None:
        begun.wait()
        _thread.interrupt_main()

    monkeypatch.setattr(execution, "_run_part", seen)
    thread = threading.Thread(target=interrupt)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # background jobs ignore it
    try:
        thread.start()
        with pytest.raises(KeyboardInterrupt):
            case.member("impacts", most_impacts=10**8)
        thread.join()
    finally:
        signal.signal(signal.SIGINT, before)


# ---- the same bits everywhere --------------------------------------------------------------------


def test_a_member_has_the_same_bits_alone_in_any_order_and_in_any_thread() -> None:
    from concurrent.futures import ThreadPoolExecutor

    rng = np.random.default_rng(11)
    damper = paper_damper("C", 0.4205, restitution=0.3)
    omegas = np.linspace(0.35, 0.6, 12)
    system = rng.integers(0, 12, 30).astype(np.int32)
    starts = [vi.State((0.0, x), (v, 1.0), p) for x, v, p in rng.normal(size=(30, 3))]
    batch = batch_of(damper, {"omega": omegas})

    def members(rows: Any) -> dict[str, Any]:
        chosen = [starts[i] for i in rows]
        return run(batch, chosen, 60.0, 90.0, EVERYTHING, system=system[rows])

    def check(found: dict[str, Any], rows: Any) -> None:
        for name, values in whole.items():
            np.testing.assert_array_equal(found[name], values[rows], err_msg=name)

    whole = members(np.arange(30))
    assert (whole["chatters"] > 0).sum() > 3
    order = rng.permutation(30)
    check(members(order), order)
    for i in range(0, 30, 7):
        check(members(np.array([i])), [i])
        alone = Case(replace(damper, omega=float(omegas[system[i]])), starts[i], 60.0, 90.0)
        check({k: v[None] for k, v in alone.member(*EVERYTHING).items()}, [i])
    parts = [np.arange(i, 30, 4) for i in range(4)]
    with ThreadPoolExecutor(2) as pool:
        for found, rows in zip(pool.map(members, parts), parts, strict=True):
            check(found, rows)


def test_a_pack_with_another_system_in_all_lanes_does_not_read_that_of_the_others() -> None:
    """First runs of the first lanes are short, of the others long; then systems come in turn."""
    damper = paper_damper("A", 1.2)
    clearances = np.array([5.0, 4.0, 6.0])
    system = np.concatenate([np.repeat([0, 1, 2], (32, 60, 60)), np.tile([0, 1, 2], 30)])
    rng = np.random.default_rng(14)
    starts = [vi.State((0.0, x), (v, -1.0), p) for x, v, p in rng.normal(size=(len(system), 3))]
    lengths = rng.uniform(20.0, 60.0, len(system))
    lengths[8:32] = 400.0
    batch = batch_of(damper, {"half_clearance": clearances})
    found = run(batch, starts, 0.0, lengths, [Final()], system=system)
    for i, (k, start) in enumerate(zip(system, starts, strict=True)):
        one = replace(damper, half_clearance=float(clearances[k]))
        alone_like(found, i, one, start, float(lengths[i]))


# ---- options and variables -----------------------------------------------------------------------


@pytest.mark.parametrize("system", [paper_damper("A", 1.2), chain(), ball(0.5)])
def test_every_observer_returns_the_variables_that_it_announces(system: Any) -> None:
    m = system if isinstance(system, vi.Mechanism) else system.mechanism
    start = vi.State((0.5,) * m.degrees, (0.1,) * m.degrees)
    found = run(batch_of(system, {}), [start] * 3, 1.0, 2.0, all_of(system))
    announced = variables_of(resolve(all_of(system)), m)
    assert list(found) == list(announced)
    for name, output in announced.items():
        assert found[name].dtype == output.dtype
        assert found[name].shape == (3, *output.shape)
        assert len(output.dims) == len(output.shape)
        assert output.attrs["long_name"]


def test_rows_of_several_observers_do_not_mix() -> None:
    case = CASES["chaotic"]
    rows = {"first": (1.0, 0.0), "second": (0.0, 1.0), "between": (-1.0, 1.0)}
    many = [Extremes(row=row, label=name) for name, row in rows.items()]
    found = case.member(
        many[0], "extremes", *many[1:], *(Rms(row=o.row, label=o.label) for o in many)
    )
    for i, name in enumerate(("first", "second")):
        assert found[f"{name}_largest"] == found["x_largest"][i]
    for name, row in rows.items():
        alone = case.member(Extremes(row=row, label="u"), Rms(row=row, label="u"))
        for kind in ("smallest", "largest", "mean", "rms"):
            assert found[f"{name}_{kind}"] == alone[f"u_{kind}"]
    assert found["between_largest"] == pytest.approx(case.system.half_clearance, abs=64.0 * UNIT)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: observer_of("period"), "observe = 'period'"),
        (lambda: resolve([]), "at least one"),
        (lambda: resolve([3]), "observe = 3"),  # type: ignore[list-item]
        (lambda: resolve([Symbol(), Symbol(returns=3)]), "same names"),
        (lambda: resolve([Section(), Section(stop="B")]), "Give one a label"),
        (lambda: resolve([Section(stop="B"), "section"]), "Give one a label"),
        (lambda: resolve([Symbol(), Symbol(tolerance=1e-3)]), "take two sweeps"),
        (lambda: Section(label="at B"), "label = 'at B'"),
        (lambda: Rotation(label=3), "label = 3"),  # type: ignore[arg-type]
        (
            lambda: variables_of(
                [Rotation(stop="B"), Rotation(stop="B", label="error")], ball(0.5)
            ),
            "rotation_error is the result of another observer",
        ),
        (lambda: resolve(["rms", Rms(row=(1.0,))]), "Give one a label"),
        (lambda: Section(points=0), "points = 0"),
        (lambda: Section(points=10**13), "points = 10000000000000: must be at most 1000000"),
        (lambda: Section(stride=10**30), "must be at most 1000000"),
        (lambda: Symbol(tolerance="a"), "tolerance = 'a'"),  # type: ignore[arg-type]
        (lambda: Section(stride=1.5), "stride = 1.5"),  # type: ignore[arg-type]
        (lambda: Section(contact=-1), "contact = -1"),
        (lambda: Section(stop="C"), "stop = 'C'"),  # type: ignore[arg-type]
        (lambda: Symbol(tolerance=0.0), "tolerance = 0.0"),
        (lambda: Symbol(returns=0), "returns = 0"),
        (lambda: Settling(tolerance=math.nan), "tolerance = nan"),
        (lambda: Settling(longest=0), "longest = 0"),
        (lambda: Harmonic(harmonic=0.0), "harmonic = 0.0: must be in [0.000976562, 1024]"),
        (
            lambda: variables_of([Harmonic()], ball(0.5)),
            "observe = Harmonic: the system has no forcing",
        ),
        (lambda: Extremes(row=(0.0, 0.0), label="u"), "row = 0"),
        (lambda: Extremes(row=(1.0, math.inf), label="u"), "finite"),
        (lambda: Extremes(row=(1.0,), label="a b"), "label = 'a b'"),
        (lambda: Rms(label="u"), "give the row"),
        (lambda: variables_of([Extremes(row=(1.0,), label="u")], chain()), "expected (3,)"),
        (lambda: variables_of([Rms(row=(0.0,) * 3 + (1.0,), label="u")], chain()), "or (9,)"),
        (lambda: variables_of([Section(contact=2)], chain()), "contact = 2"),
        (lambda: variables_of([Section(stop="A")], ball(0.5)), "stop"),
        (
            lambda: variables_of(
                [*resolve("speeds"), Extremes(row=(1.0,), label="speed")], ball(0.5)
            ),
            "speed_largest is the result of another observer",
        ),
        (
            lambda: variables_of([Rms(row=(1.0,), label=f"u{i}") for i in range(17)], ball(0.5)),
            "16",
        ),
    ],
)
def test_bad_options_are_refused_by_name(make: Any, says: str) -> None:
    with pytest.raises(vi.InvalidParameterError) as refused:
        make()
    assert says in str(refused.value)


def test_sections_at_several_stops_are_those_of_several_sweeps() -> None:
    case = CASES["chaotic"]
    upper, lower = Section(points=7), Section(points=5, stop="B", label="lower")
    turns = [Rotation(label="a"), Rotation(stop="B", label="b")]
    more = ["lyapunov", "symbol", Rms(row=(-1.0, 1.0), label="gap")]
    found = case.member(*more[:1], upper, *turns, lower, *more[1:])
    apart = [case.member(one) for one in (upper, lower, *turns)]
    for alone in (*apart, case.member(*more)):
        for name, values in alone.items():
            np.testing.assert_array_equal(found[name], values, strict=True)
    assert found.keys() == set().union(*apart, case.member(*more))
    assert not np.array_equal(found["section_lower_phase"], found["section_phase"][-5:])


def test_sections_of_several_lengths_have_dimensions_of_their_own() -> None:
    sections = [Section(points=3), Section(points=2, stop="B", label="lower")]
    start = vi.State((0.0, 0.0), (0.0, 1.0))
    over = {"omega": [1.2, 1.21]}
    damper = paper_damper("A", 1.2)
    found = vi.sweep(
        damper, over=over, start=start, observe=sections, settle_periods=50, progress=False
    )
    assert found["section_position"].dims == ("omega", "point", "coordinate")
    assert found["section_lower_position"].dims == ("omega", "point_lower", "coordinate")
    assert dict(found.sizes) == {"omega": 2, "point": 3, "coordinate": 2, "point_lower": 2}


def test_equal_observers_are_computed_once() -> None:
    assert resolve(["symbol", Symbol(), "final"]) == (Symbol(), observer_of("final"))
    assert describe(resolve(Section(points=np.int64(3)))) == describe(resolve(Section(points=3)))
    assert type(describe(resolve(Section(points=np.int64(3))))[0]["points"]) is int
    assert resolve("symbol") == resolve(Symbol()) == (Symbol(),)


def test_every_outcome_has_a_sentence() -> None:
    assert all(outcome.sentence for outcome in MemberStatus)
