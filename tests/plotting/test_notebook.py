"""What a notebook shows of machines and results: words, a table, a picture."""

from __future__ import annotations

import base64
import re
import warnings
from io import BytesIO

import matplotlib.pyplot as plt
import pytest
from PIL import Image

import vibroimpact as vi
from tests.support.systems import paper_damper
from vibroimpact.design.objective import Judge

DAMPER = paper_damper("A", 1.0)
ORBIT = vi.symmetric_orbits(DAMPER)[0]
RUN = vi.simulate(DAMPER, ORBIT.state, impacts=12)


def picture(html: str) -> Image.Image:
    found = re.search(r'src="data:image/png;base64,([^"]*)"', html)
    assert found is not None
    return Image.open(BytesIO(base64.b64decode(found[1])))


@pytest.mark.parametrize(
    "shown", [DAMPER, DAMPER.mechanism, ORBIT, RUN], ids=lambda x: type(x).__name__
)
def test_a_cell_shows_words_and_a_picture_and_leaves_no_figure_open(shown: object) -> None:
    before = plt.get_fignums()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        html = shown._repr_html_()  # type: ignore[attr-defined]
    assert plt.get_fignums() == before
    assert min(picture(html).size) > 100
    first = html.partition("</div>")[0]
    assert type(shown).__name__ in first


def test_the_table_of_a_machine_has_each_parameter_with_its_value_and_its_unit() -> None:
    physical = vi.ImpactDamper.from_physical(
        M1=2.0, M2=0.1, K=800.0, C=3.0, F0=5.0, Omega=21.0, D=0.004, restitution=0.6
    )
    html = physical._repr_html_()
    assert "<td>half_clearance</td>\n      <td>2 mm</td>" in html
    assert "<td>half_clearance</td>\n      <td>2 mm</td>" not in DAMPER._repr_html_()


def test_the_table_of_a_run_is_its_frame_shortened_in_the_middle() -> None:
    html = RUN._repr_html_()
    assert f"<td>{RUN.time[0]:.6g}</td>" in html
    assert f"<td>{RUN.time[-1]:.6g}</td>" in html
    assert f"<td>{RUN.time[6]:.6g}</td>" not in html


def no_numbers(*_: object) -> None:
    raise AssertionError("it computes")


@pytest.mark.slow
def test_a_branch_and_a_curve_have_their_special_points_and_no_normal_form(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    branch = vi.continue_orbit(ORBIT, "omega", (1.0, 1.01), progress=False)
    point = branch["NS1"]
    plane, few = ((1.0, 1.01), (4.9, 5.1)), vi.Steps(points=12)
    curve = vi.continue_bifurcation(
        point, ("omega", "half_clearance"), plane, steps=few, progress=False
    )
    monkeypatch.setattr(type(point), "normal_form", property(no_numbers))
    html = branch._repr_html_()
    assert f"<td>{point.parameter:.6g}</td>" in html
    assert min(picture(html).size) > 100
    html = curve._repr_html_()
    assert f"<td>{curve.values[0, 1]:.6g}</td>" in html
    assert min(picture(html).size) > 100


@pytest.mark.slow
def test_a_design_has_its_parameters_and_simulates_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    objective = vi.Objective("omega", (1.1, 1.2), "x1", points=2, starts=1, periods=5)
    vary = {"half_clearance": (4.0, 6.0)}
    best = vi.optimise(DAMPER, vary, objective, budget=32, refine=0, progress=False)
    repr(best)  # compares it with the machine without impacts
    for name in ("over_band", "opened"):
        monkeypatch.setattr(Judge, name, no_numbers)
    html = best._repr_html_()
    value = f"{best.parameters['half_clearance']:.6g}"
    assert f"<td>half_clearance</td>\n      <td>{value}</td>" in html
    assert min(picture(html).size) > 100


def test_text_is_escaped_and_what_cannot_be_drawn_has_its_words() -> None:
    family = vi.Family(lambda k=1.0: vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[k]]))
    html = family._repr_html_()
    assert "&lt;lambda&gt;" in html
    assert "<lambda>" not in html
