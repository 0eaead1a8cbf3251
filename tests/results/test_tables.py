"""Tables and datasets of results: rows as asked, codes in words, units."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

import vibroimpact as vi
from vibroimpact import plotting

DAMPER = vi.ImpactDamper.from_physical(
    M1=10.0, M2=0.8, K=4e4, C=40.0, F0=60.0, Omega=66.0, D=0.006, restitution=0.6
)
pytestmark = pytest.mark.usefixtures("no_windows")


@pytest.fixture(scope="module")
def orbit() -> vi.Orbit:
    return vi.symmetric_orbits(DAMPER)[0]


@pytest.fixture(scope="module")
def branch(orbit: vi.Orbit) -> vi.Branch:
    return vi.continue_orbit(orbit, "omega", (64.0, 66.5))


def test_a_table_of_a_run_has_a_row_for_each_event_with_its_kind_in_words(
    orbit: vi.Orbit, tmp_path: Path
) -> None:
    run = vi.simulate(DAMPER, orbit.state, impacts=5)
    table = run.to_dataframe()
    assert len(table) == 5
    assert [*table.status] == ["impact"] * 5
    run.to_csv(tmp_path / "run.csv")
    written = pd.read_csv(tmp_path / "run.csv")
    assert [*written.columns[:5]] == ["time [s]", "status", "contact", "side", "position_0 [mm]"]
    parts = {"mm": 1e3, "mm/s": 1e3}
    for title, name in zip(written.columns, table.columns, strict=True):
        bare, _, unit = title.partition(" [")
        assert bare == name
        expected = table[name] if not unit else table[name] * parts.get(unit.removesuffix("]"), 1.0)
        assert [*written[title]] == [*expected]
    with pytest.raises(vi.InvalidParameterError, match=r"must end in \.csv"):
        run.to_csv(tmp_path / "run.nc")


def test_special_points_of_a_branch_are_a_table(branch: vi.Branch) -> None:
    table = branch.to_dataframe("special")
    assert [*table.special_label] == [point.label for point in branch.special_points] == ["GR1"]
    assert [*table.special_parameter] == [point.parameter for point in branch.special_points]
    with pytest.raises(vi.InvalidParameterError, match=r"dim = 'row': must be one of point"):
        branch.to_dataframe("row")


def test_variables_have_units_where_the_machine_is_in_si(
    orbit: vi.Orbit, branch: vi.Branch
) -> None:
    run = vi.simulate(DAMPER, orbit.state, impacts=2).to_dataset()
    assert {n: run[n].units for n in ("time", "position", "rate_after", "phase")} == {
        "time": "s", "position": "m", "rate_after": "m/s", "phase": "rad"
    }  # fmt: skip
    data = branch.to_dataset()
    assert (data["values"].units, data.impact_speed.units) == ("rad/s", "m/s")
    plain = vi.ImpactOscillator(zeta=0.05, omega=1.2, restitution=0.8, clearance=1.0)
    assert "units" not in vi.simulate(plain, plain.free_start(), impacts=2).to_dataset().time.attrs


def test_sweeps_have_units_where_the_machine_is_in_si() -> None:
    found = vi.sweep(
        DAMPER, over={"omega": [66.0]}, start=DAMPER.free_start(), observe="speeds",
        settle_periods=2, periods=2, progress=False,
    )  # fmt: skip
    assert (found.omega.units, found.speed_mean.units, found.time.units) == ("rad/s", "m/s", "s")


def test_one_result_is_drawn_where_several_may_be(orbit: vi.Orbit, branch: vi.Branch) -> None:
    one, listed = plotting.plot_branches(branch), plotting.plot_branches([branch])
    assert len(one.lines) == len(listed.lines)
    assert plotting.plot_multipliers(orbit).get_xlabel().endswith(r"\nu$")
    assert plotting.plot_phase_portrait(orbit, row="x2 - x1").get_xlabel() == "$x_{2}-x_{1}$ [mm]"


def test_a_record_in_si_gives_its_spectrum_units() -> None:
    time, values = [0.0, 0.1, 0.2], [0.0, 3.0, 0.0]
    shaking = vi.ForceRecord(time, values, kind="base", si=True)
    assert shaking.to_dataset()["values"].units == "m/s²"
    assert vi.ForceRecord(time, values, si=True).to_dataset()["values"].units == "N"
    spectrum = vi.response_spectrum(shaking, [1.0, 5.0], unit="Hz")
    assert spectrum.plot("displacement").get_ylabel() == "largest $|x|$ [mm]"
    plain = vi.response_spectrum(vi.ForceRecord(time, values, kind="base"), [1.0, 5.0])
    assert plain.plot("displacement").get_ylabel() == "largest $|x|$"
