"""The built page: the bits of Python, and the page itself in a browser, where `make explorer` and these are there."""

from __future__ import annotations

import base64
import json
import math
import re
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.explorer import page, widget
from vibroimpact.explorer.link import link_of, read_link
from vibroimpact.explorer.page_data import catalogue, machine_data, start_of, text_of, values_of
from vibroimpact.machines.machine import Machine
from vibroimpact.model.mechanism import stop_sizes
from vibroimpact.model.parameters import with_parameters

pytestmark = pytest.mark.slow
HERE = Path(__file__).parent
BUILT = HERE.parents[1] / "web" / "build"
STARTS, IMPACTS = 20, 40
SINES = (
    "ball-harvester",
    "dual-component",
)  # NumPy's sine of a parameter differs from the kernel's
BROWSER = ("--no-sandbox", "--headless", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def random_runs(machine: Machine) -> Iterator[dict[str, Any]]:
    """Runs of a machine from random starts, half of its parameters changed by up to 30 %."""
    random = np.random.default_rng(7)
    m, begin = machine.mechanism, start_of(machine)
    size, omega = max(stop_sizes(m), default=1.0), m.omega or 1.0
    found = 0
    while found < STARTS:
        factors = np.exp(random.uniform(-0.3, 0.3, 40) * (random.random(40) < 0.5))
        values = {k: x * f for (k, x), f in zip(values_of(machine).items(), factors, strict=False)}
        x = np.array(begin.position) + 0.3 * size * random.normal(size=m.degrees)
        v = size * omega * random.normal(size=m.degrees)
        start = vi.State(tuple(x), tuple(v), random.uniform(0.0, 6.28))
        t_max = 400.0 * math.pi / omega
        try:
            run = vi.simulate(with_parameters(machine, values), start, impacts=IMPACTS, t_max=t_max)
        except vi.InvalidParameterError:
            continue  # behind a stop, or a restitution above 1
        found += 1
        columns = [
            run.status,
            run.contact,
            run.limit_side,
            run.time,
            run.rate_before,
            run.rate_after,
            run.phase,
        ]
        rows = np.column_stack(
            [*columns, run.position, run.velocity_before, run.velocity_after]
        ).tolist()
        yield {
            "values": values, "start": {"x": [*start.position], "v": [*start.velocity], "phase": start.phase},
            "t_max": t_max, "impacts": IMPACTS, "end": int(run.end), "rows": rows,
        }  # fmt: skip


def test_the_page_has_the_bits_of_python_impact_by_impact(tmp_path: Path) -> None:
    if not (shutil.which("node") and (BUILT / "data.mjs").exists()):
        pytest.skip("Node.js is not installed, or the page is not built: make explorer")
    machines = {k: m for k, m in catalogue().items() if k not in SINES}
    data = {name: machine_data(machine) for name, machine in machines.items()}
    (tmp_path / "machines.json").write_text(text_of(data, "impact-damper", {}))
    runs = {name: [*random_runs(machine)] for name, machine in machines.items()}
    (tmp_path / "runs.json").write_text(json.dumps(runs).replace("NaN", "null"))
    command = ["node", str(HERE / "same_bits.mjs"), str(tmp_path), str(BUILT)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    found = json.loads(done.stdout)
    assert found["differ"] == []
    assert found["compared"] > STARTS * len(machines) * 10


@pytest.fixture
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    chromium = shutil.which("chromium")
    if not chromium or not page.PAGE.exists():
        pytest.skip("Chromium is not installed, or the page is not built: make explorer")
    with playwright.sync_playwright() as found:
        one = found.chromium.launch(executable_path=chromium, args=[*BROWSER])
        yield one
        one.close()


def test_the_page_runs_from_a_folder_and_takes_clicks_and_links(
    browser: Any, tmp_path: Path
) -> None:
    damper = vi.ImpactDamper(**vi.ImpactDamper.example)
    ball = vi.machines.BouncingBall()  # it chatters
    data = {"impact-damper": machine_data(damper), "bouncing-ball": machine_data(ball)}
    path = tmp_path / "page.html"
    path.write_text(page.page_with(data, "impact-damper"), encoding="utf-8")
    tab, errors = browser.new_page(), list[str]()
    tab.on("pageerror", lambda error: errors.append(str(error)))
    tab.goto(path.as_uri())
    tab.wait_for_selector("body[data-ready]")
    tab.wait_for_function("/[1-9]/.test(document.getElementById('d-section').textContent)")
    field = tab.locator("#f-omega")
    field.fill("0.9")
    field.press("Enter")
    assert "omega=0.9&" in tab.url
    tab.click("#d-go")
    tab.wait_for_function(
        "/400 in/.test(document.getElementById('d-diagram').textContent)", timeout=120000
    )
    box = tab.locator("#diagram").bounding_box()
    tab.mouse.click(box["x"] + 0.7 * box["width"], box["y"] + 0.5 * box["height"])
    taken = float(field.input_value())
    assert 1.0 < taken < 1.5
    with tab.expect_download() as saved:
        tab.click("[data-csv=diagram]")
    lines = Path(saved.value.path()).read_text().splitlines()
    assert lines[0] == "omega,impact_speed"
    assert len(lines) > 400
    again = browser.new_page()
    again.goto(tab.url)
    again.wait_for_selector("body[data-ready]")
    assert float(again.locator("#f-omega").input_value()) == taken
    again.goto(f"{path.as_uri()}#machine=bouncing-ball&nonsense=1")
    again.reload()
    again.wait_for_function("/Left out/.test(document.getElementById('say').textContent)")
    again.wait_for_function("/[1-9]/.test(document.getElementById('d-section').textContent)")
    again.goto(f"{path.as_uri()}#machine=teapot")
    again.reload()
    again.wait_for_function("/teapot/.test(document.getElementById('say').textContent)")
    assert re.search("impact-damper", again.locator("#machine").input_value())
    assert errors == []


HERE_ALONE = "http://localhost:9"  # nobody is asked there
NOTEBOOK = """<!doctype html><div id="cell"></div><script type="module">
import widget from "./widget.js";
const heard = {}, traits = %s;
const page = Uint8Array.from(atob(%s), (c) => c.charCodeAt(0));
window.model = {
  get: (name) => traits[name],
  set: (name, value) => { traits[name] = value; },
  save_changes: () => { window.saved = traits.link; },
  on: (name, f) => { heard[name] = f; },
  off: (name) => { delete heard[name]; },
  send: () => heard["msg:custom"]({ link: traits.link }, [new DataView(page.buffer)]),
  assign: (link) => { traits.link = link; heard["change:link"](); },
};
widget.render({ model, el: document.getElementById("cell") });
</script>"""


def test_the_widget_takes_links_and_gives_those_of_the_page(browser: Any) -> None:
    damper = vi.ImpactDamper(**vi.ImpactDamper.example)
    link = link_of(replace(damper, omega=0.875), damper.free_start())
    content = page.page_with({"impact-damper": machine_data(damper)}, "impact-damper").encode()
    traits = json.dumps({"link": link, "height": 700})
    notebook = NOTEBOOK % (traits, json.dumps(base64.b64encode(content).decode()))
    script = Path(widget.__file__).with_name("widget.js")
    tab, errors = browser.new_page(), list[str]()
    tab.on("pageerror", lambda error: errors.append(str(error)))
    tab.route(
        f"{HERE_ALONE}/", lambda route: route.fulfill(body=notebook, content_type="text/html")
    )
    tab.route(f"{HERE_ALONE}/widget.js", lambda route: route.fulfill(path=script))
    tab.goto(f"{HERE_ALONE}/")
    field = tab.frame_locator("iframe").locator("#f-omega")
    tab.wait_for_function("window.saved")
    assert float(field.input_value()) == 0.875
    assert read_link(tab.evaluate("window.saved"), damper, damper.free_start()) == (
        replace(damper, omega=0.875), damper.free_start()
    )  # fmt: skip
    field.fill("0.75")
    field.press("Enter")
    tab.wait_for_function("/omega=0.75&/.test(window.saved)")
    start = vi.State((0.5, -0.25), (0.0, 1.0), 0.5)
    tab.evaluate("link => model.assign(link)", link_of(replace(damper, omega=1.5), start))
    tab.wait_for_function("/omega=1.5&.*x=0.5,-0.25&v=0,1&phase=0.5/.test(window.saved)")
    assert float(field.input_value()) == 1.5
    assert errors == []
