"""Commands on one motion say what the library finds: classify, lyapunov, orbit, a sweep of one member."""

from __future__ import annotations

import pytest
from support.commands import opened, said

import vibroimpact as vi

pytestmark = pytest.mark.usefixtures("no_windows", "own_folder")

OSCILLATOR = vi.ImpactOscillator(zeta=0.05, omega=2.0, restitution=0.8, clearance=0.0)
MACHINE = ["impact-oscillator", "--zeta", "0.05", "--omega", "2.0", "--restitution", "0.8"]
MACHINE += ["--clearance", "0"]
START = OSCILLATOR.free_start()


def test_classify_says_the_attractor_of_the_library(capsys: pytest.CaptureFixture[str]) -> None:
    out = said(["classify", *MACHINE, "--points", "300", "--out", "c.svg"], capsys)
    assert repr(vi.classify(OSCILLATOR, START, points=300)) in out


def test_lyapunov_says_the_exponents_of_the_library(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["lyapunov", *MACHINE, "--impacts", "1200", "--settle-impacts", "100", "--out", "l.nc"]
    out = said(argv, capsys)
    found = vi.lyapunov_exponent(OSCILLATOR, START, impacts=1200, settle_impacts=100)
    assert f"largest exponent {found.statement} per unit of time" in out
    assert opened("l.nc").attrs["value"] == found.value
    all_of_them = vi.lyapunov_spectrum(OSCILLATOR, START, impacts=1200, settle_impacts=100)
    assert repr(all_of_them) in said([*argv, "--spectrum"], capsys)


def test_orbit_finds_the_orbit_of_any_machine(capsys: pytest.CaptureFixture[str]) -> None:
    out = said(["orbit", *MACHINE, "--out", "o.nc", "--out", "o.svg"], capsys)
    orbit = vi.find_orbit(OSCILLATOR, START)
    assert repr(orbit) in out
    assert vi.load("o.nc").multipliers == pytest.approx(orbit.multipliers, rel=1e-12)


def test_a_sweep_of_one_member_says_its_values(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["sweep", *MACHINE, "--over", "omega=2.0", "--observe", "speeds"]
    out = said([*argv, "--settle-periods", "20", "--periods", "5"], capsys)
    found = vi.sweep(
        OSCILLATOR,
        over={"omega": [2.0]},
        start=START,
        observe="speeds",
        settle_periods=20,
        periods=5,
    )
    assert f"speed_mean = {found.speed_mean.item():.6g}" in out
    assert "1 member: 1 ok" in out
    assert str(OSCILLATOR) in out
