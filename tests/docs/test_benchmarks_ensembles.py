"""The benchmark of ensembles runs, and refuses wrong answers; nothing is timed here."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parents[2]))  # benchmarks are not installed

from benchmarks import __main__ as benchmarks
from benchmarks import comparison, double_roots, ensemble_run, ensembles, overhead
from benchmarks.case import SET_A, random_starts
from benchmarks.equality import ImpactsDifferError
from benchmarks.peers import diffrax_dopri8, heyoka_batch
from benchmarks.peers.compiled import CERTIFIED
from benchmarks.peers.ensemble import RunMembers
from benchmarks.peers.method import Method, Result, UnavailableError
from benchmarks.structures import random_ensemble, two_masses

SEED = 20


def starts(count: int) -> Any:
    return random_starts(SET_A, count, np.random.default_rng(SEED))


@dataclass(frozen=True)
class Late:
    """The certified closed form with one impact time shifted."""

    shift: float
    name: str = "late"
    settings: str = ""
    max_starts: int | None = None
    tolerance: float = 1e-9

    def run(self, starts: Any, parameters: Any, impacts: int) -> Result:
        times = CERTIFIED.run(starts, parameters, impacts).times.copy()
        times[-1, 0] += self.shift
        return Result(0.0, times)


def checked(method: Method) -> Any:
    return comparison.check((method,), CERTIFIED, starts(8), None)[method]


@pytest.mark.slow
def test_every_part_runs_and_writes_its_numbers_and_picture(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    methods = (RunMembers(), ensembles.REFERENCE, ensembles.BASELINE)
    monkeypatch.setattr(ensembles, "METHODS", methods)
    file, picture = tmp_path / "numbers.json", tmp_path / "curves.svg"
    files = ["--json", str(file), "--plot", str(picture)]
    assert benchmarks.main(["ensembles", "--quick", *files]) == 0
    found = json.loads(file.read_text())["ensembles"]
    for motion in ("random starts", "steady motion"):
        assert [row["method"] for row in found[motion]] == [m.name for m in methods]
        assert all(row["nanoseconds_per_impact"] > 0.0 for row in found[motion])
    curves = {point["against"] for point in found["points"]}
    assert curves == {"degrees of freedom", "contacts", "members", "threads", "structure"}
    assert [plane["observers"] for plane in found["planes"]] == ["symbol", "symbol, lyapunov"]
    assert "<svg" in picture.read_text()


def test_an_impact_time_off_by_more_than_the_tolerance_is_refused() -> None:
    assert checked(Late(0.0)).largest_error == 0.0
    with pytest.raises(ImpactsDifferError, match="late: 1 of"):
        checked(Late(2e-9))


def test_the_ensemble_finds_the_same_impacts_and_every_double_root() -> None:
    rng = np.random.default_rng(SEED)
    flights = double_roots.construct(SET_A, 10, rng)  # one of each depth
    method = RunMembers()
    row = comparison.check((method,), CERTIFIED, starts(40), flights)[method]
    assert row.double_roots_found == 10


def test_heyoka_in_lanes_finds_the_same_impacts() -> None:
    pytest.importorskip("heyoka", reason="heyoka has no wheels for this platform")
    assert checked(heyoka_batch.HeyokaBatch()).largest_error <= 1e-9


def test_a_peer_that_is_not_installed_is_left_out_by_name(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def missing(module: str, install: str) -> Any:
        raise UnavailableError(f"No module named {module}: pip install {install}")

    monkeypatch.setattr(diffrax_dopri8, "require", missing)
    diffrax_dopri8._simulator.cache_clear()
    rows = comparison.check((diffrax_dopri8.Diffrax(), CERTIFIED), CERTIFIED, starts(4), None)
    assert list(rows) == [CERTIFIED]
    assert "left out: Diffrax Dopri8, vmap: No module named jax" in capsys.readouterr().out


def structure() -> Any:
    return random_ensemble(two_masses(), 4, np.random.default_rng(SEED))


def test_one_ulp_in_an_impact_time_of_an_ensemble_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ensemble_run.assert_right(structure())
    right = ensemble_run.impact_times

    def off(prepared: ensemble_run.Prepared) -> Any:
        times = right(prepared)
        times[2, 3] = np.nextafter(times[2, 3], 0.0)
        return times

    monkeypatch.setattr(ensemble_run, "impact_times", off)
    with pytest.raises(ImpactsDifferError, match="simulate"):
        ensemble_run.assert_right(structure())


def test_an_error_of_both_engines_is_found_by_scipy(monkeypatch: pytest.MonkeyPatch) -> None:
    right = ensemble_run.impact_times(
        ensemble_run.Prepared(structure(), ensemble_run.COMPARED_IMPACTS)
    )
    wrong = right + 2.0 * ensemble_run.WITNESS_TOLERANCE
    monkeypatch.setattr(ensemble_run, "impact_times", lambda *_: wrong)
    monkeypatch.setattr(ensemble_run, "_scalar_times", lambda *_: wrong)
    with pytest.raises(ImpactsDifferError, match="SciPy"):
        ensemble_run.assert_right(structure())


def test_members_that_end_before_their_impacts_are_not_timed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(ensemble_run, "WINDOW", 0.1)
    with pytest.raises(ImpactsDifferError, match="OK"):
        ensemble_run.nanoseconds(structure(), 5, 1)


class Altered(overhead.Plane):
    """A plane whose symbols are wrong in the sweep, or everywhere."""

    everywhere = False

    def swept(self) -> Any:
        dataset = super().swept()
        return dataset.assign(p=dataset["p"] * 2)

    def kernel_alone(self) -> Any:
        found, seconds = super().kernel_alone()
        return found | ({"p": found["p"] * 2} if self.everywhere else {}), seconds


@pytest.mark.parametrize(("everywhere", "message"), [(False, "p: the sweep"), (True, "counted")])
def test_a_plane_with_wrong_symbols_is_refused(
    monkeypatch: pytest.MonkeyPatch, everywhere: bool, message: str
) -> None:
    overhead.assert_same(overhead.Plane(3, ["symbol"]))
    monkeypatch.setattr(Altered, "everywhere", everywhere)
    with pytest.raises(ImpactsDifferError, match=message):
        overhead.assert_same(Altered(3, ["symbol"]))
