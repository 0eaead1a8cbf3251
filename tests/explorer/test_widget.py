"""The explorer in a notebook: its permalink, and what page and Python tell each other."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import vibroimpact as vi
from vibroimpact.explorer import page, widget
from vibroimpact.explorer.link import link_of, read_link
from vibroimpact.explorer.page_data import machine_data, values_of

DAMPER = vi.ImpactDamper(**vi.ImpactDamper.example)
START = vi.State((0.1, -1.0 / 3.0), (1e-7, 1e21), 2.5)
KEPT = cache(machine_data)
pytest.importorskip("anywidget", reason="anywidget is not installed")


class Sent(list[tuple[Any, Any]]):
    """Messages to the page."""

    def __call__(self, content: Any, buffers: Any = None) -> None:
        self.append((content, buffers))


@pytest.fixture
def explorer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> vi.Explorer:
    path = tmp_path / "page.html"
    path.write_text(f"<html>{page.PLACE}</html>")
    monkeypatch.setattr(page, "PAGE", path)
    monkeypatch.setattr(widget, "machine_data", KEPT)
    one = vi.Explorer(DAMPER)
    monkeypatch.setattr(one.widget, "send", Sent(), raising=False)
    return one


def test_a_permalink_comes_back_to_the_last_bit() -> None:
    varied = replace(DAMPER, omega=math.pi, zeta=1e-9)
    assert read_link(link_of(varied, START), DAMPER, vi.State((0.0, 0.0), (0.0, 0.0))) == (
        varied,
        START,
    )
    m = DAMPER.mechanism
    changed = replace(m, stiffness=[[1.1 * x for x in row] for row in m.stiffness])
    assert read_link(link_of(changed, START), m, START) == (changed, START)


@pytest.mark.parametrize(
    "link", ["machine=shaker", "machine=impact-damper&omega=fast", "machine=impact-damper&colour=1",
             "machine=impact-damper&restitution=2", "nonsense"],
)  # fmt: skip
def test_a_permalink_of_something_else_is_refused(link: str) -> None:
    with pytest.raises(vi.InvalidParameterError):
        read_link(link, DAMPER, START)


def test_what_the_page_changes_is_read_in_python_and_told(explorer: vi.Explorer) -> None:
    heard: list[float] = []
    explorer.observe(lambda one: heard.append(one.system.omega))
    explorer.widget.set_state(
        {"link": "machine=impact-damper&omega=0.9&x=0.5,0.25&v=0,1&phase=0.1"}
    )
    assert explorer.system == replace(DAMPER, omega=0.9)
    assert explorer.start == vi.State((0.5, 0.25), (0.0, 1.0), 0.1)
    explorer.widget.set_state({"link": "machine=impact-damper&omega=0.9&restitution=7"})
    assert explorer.system == replace(DAMPER, omega=0.9)  # the page says why it is not taken
    assert heard == [0.9]


def test_what_python_changes_is_in_the_link_without_another_page(explorer: vi.Explorer) -> None:
    varied = replace(DAMPER, omega=0.8)
    explorer.system = varied
    explorer.start = START
    assert read_link(explorer.widget.link, DAMPER, DAMPER.free_start()) == (varied, START)
    assert not explorer.widget.send


def test_another_machine_is_another_page(explorer: vi.Explorer) -> None:
    ball = vi.machines.BouncingBall()
    explorer.system = ball
    (message, (content,)) = explorer.widget.send[0]
    assert message["link"] == explorer.widget.link == link_of(ball, ball.free_start())
    assert b'id="machines"' in content


def asked(explorer: vi.Explorer, **values: float) -> dict[str, Any]:
    """What the page is told when it asks for a compilation at these values."""
    question = {
        "machine": "impact-damper", "values": {**values_of(DAMPER), **values},
        "start": {"x": [0.0, 0.0], "v": [0.0, 0.0], "phase": 0.0},
    }  # fmt: skip
    explorer.widget._handle_custom_msg({"question": question}, [])
    message, (content,) = explorer.widget.send.pop()
    assert message == {"question": question}
    return dict(json.loads(content))


def test_the_page_is_given_a_compilation_at_values_that_it_was_not_given(
    explorer: vi.Explorer,
) -> None:
    assert asked(explorer, restitution=0.0)["recording"]["inputs"] == [*values_of(DAMPER)]
    assert "restitution" in asked(explorer, restitution=-2.0)["refused"]
    explorer.widget._handle_custom_msg({"wants": "page"}, [])
    assert explorer.widget.send.pop()[0] == {"link": explorer.widget.link}


def test_a_start_behind_a_stop_is_refused(explorer: vi.Explorer) -> None:
    before = explorer.start
    with pytest.raises(vi.InvalidParameterError, match="behind"):
        explorer.start = vi.State((0.0, 99.0), (0.0, 0.0))
    assert explorer.start == before
