"""Labels of parts in the drawing of a mechanism stay in their places, with units."""

from __future__ import annotations

import matplotlib.pyplot as plt
import pytest

import vibroimpact as vi
from vibroimpact import plotting

pytestmark = pytest.mark.usefixtures("no_windows")

HAMMER = vi.Mechanism(
    mass=[[40.0, 0.0], [0.0, 8.0]],
    damping=[[60.0, -20.0], [-20.0, 20.0]],
    stiffness=[[2e5, -1e5], [-1e5, 1e5]],
    forces=(vi.Harmonic(60.0, (100.0, 0.0)),),
    elements=(
        vi.RigidStop((-1.0, 1.0), lower=-0.0100125, upper=0.0075125, restitution=0.71),
        vi.SoftStop((1.0, 0.0), upper=0.0151, stiffness=2.9e6),
    ),
    si=True,
)


def test_a_label_between_masses_does_not_reach_into_them() -> None:
    ax = plotting.plot_mechanism(HAMMER)
    figure = ax.figure
    figure.draw_without_rendering()
    texts = {text.get_text(): text.get_window_extent() for text in ax.texts}
    (label,) = (box for text, box in texts.items() if text.startswith("rigid stop 0"))
    masses = sorted(
        (p.get_window_extent() for p in ax.patches if p.get_height() > 2.0), key=lambda b: b.x0
    )  # type: ignore[attr-defined]
    assert masses[0].x1 < label.x0 < label.x1 < masses[1].x0
    plt.close("all")


def test_numbers_have_units_and_powers() -> None:
    texts = [text.get_text() for text in plotting.plot_mechanism(HAMMER).texts]
    assert r"$m_{1}=40\,\mathrm{kg}$" in texts
    assert any(r"=15.1\,\mathrm{mm}" in text for text in texts)
    plain = [text.get_text() for text in plotting.plot_mechanism(HAMMER.replace(si=False)).texts]
    assert any(r"2.9\times10^{6}" in text for text in plain)
    assert not any("SI" in text or "mathrm" in text for text in plain)
