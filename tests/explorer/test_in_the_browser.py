"""The page in a headless Chromium: what a reader does with it, where `make explorer` and a browser are there."""

from __future__ import annotations

import base64
import json
import os
import re
import threading
from collections.abc import Iterator
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from support.chromium import a_browser

import vibroimpact as vi
from vibroimpact.explorer import page
from vibroimpact.explorer.link import link_of, read_link
from vibroimpact.explorer.page_data import machine_data

pytestmark = pytest.mark.slow
DAMPER = vi.ImpactDamper(**vi.ImpactDamper.example)
BALL = vi.machines.BouncingBall()  # it chatters
FRAME_MS, PLANE_SECONDS = 50.0, 10.0
MOVES = "/[1-9]/.test(document.getElementById('d-section').textContent)"
# How long each frame takes the page, in milliseconds.
FRAMES = """
window.frames_ms = [];
const next = window.requestAnimationFrame;
window.requestAnimationFrame = (draw) => next((now) => {
  const since = performance.now();
  draw(now);
  frames_ms.push(performance.now() - since);
});
"""
# A browser that does not know relaxed SIMD.
OLDER = """
const instantiate = WebAssembly.instantiate;
let tried = 0;
const refused = new WebAssembly.CompileError("relaxed SIMD is not known");
WebAssembly.instantiate = (...given) => tried++ ? instantiate(...given) : Promise.reject(refused);
"""
SET_A = (
    "machine=impact-damper&mass_ratio=0.1&omega_n=0.5&zeta=0.045&restitution=0.8&half_clearance=5"
)
CHAOTIC = f"{SET_A}&omega=0.44"
# A browser that refuses WebGL 2, and one whose contexts are seen by the test.
NO_WEBGL = """
const context = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...given) {
  return kind === "webgl2" ? null : context.call(this, kind, ...given);
};
"""
SEEN_WEBGL = """
const context = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...given) {
  const found = context.call(this, kind, ...given);
  if (kind === "webgl2") window.webgl = found;
  return found;
};
"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if not page.PAGE.exists():
        pytest.skip("The page is not built: make explorer")
    with a_browser() as one:
        yield one


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Address of a page with two machines, as a file."""
    data = {"impact-damper": machine_data(DAMPER), "bouncing-ball": machine_data(BALL)}
    path = tmp_path_factory.mktemp("page") / "page.html"
    path.write_text(page.page_with(data, "impact-damper"), encoding="utf-8")
    return path.as_uri()


@pytest.fixture
def tab(browser: Any) -> Iterator[Any]:
    """A tab without a network, in which nothing may fail."""
    context = browser.new_context(offline=True)
    one, errors = context.new_page(), list[str]()
    one.on("pageerror", lambda error: errors.append(str(error)))
    yield one
    assert errors == []
    context.close()


def opened(tab: Any, address: str) -> Any:
    tab.goto(address)
    tab.wait_for_selector("body[data-ready]")
    return tab


def value(tab: Any, name: str) -> float:
    return float(tab.locator(f"#f-{name}").input_value())


def click_in(tab: Any, panel: str, x: float, y: float) -> None:
    box = tab.locator(f"#{panel}").bounding_box()
    tab.locator(f"#{panel}").click(position={"x": x * box["width"], "y": y * box["height"]})


def saved(tab: Any, what: str) -> bytes:
    with tab.expect_download() as download:
        tab.click(f"[data-save={what}]")
    return Path(download.value.path()).read_bytes()


def test_from_a_folder_without_a_network_the_machine_moves(tab: Any, folder: str) -> None:
    opened(tab, folder)
    tab.wait_for_function(MOVES)
    before = tab.locator("#motion").screenshot()
    tab.wait_for_timeout(300)
    assert tab.locator("#motion").screenshot() != before
    tab.click("#run")
    assert tab.locator("#run").text_content() == "Run"


def test_dragging_a_slider_changes_the_parameter_the_link_and_the_motion(
    tab: Any, folder: str
) -> None:
    opened(tab, folder)
    slider = tab.get_by_label(re.compile("^half_clearance:"))
    before, box = value(tab, "half_clearance"), slider.bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    tab.mouse.move(x, y)
    tab.mouse.down()
    tab.mouse.move(x + 0.2 * box["width"], y, steps=4)
    tab.mouse.up()
    after = value(tab, "half_clearance")
    assert after > 1.3 * before  # a fifth of a slider over a factor of 16 is a factor of 1.7
    assert f"half_clearance={after}" in tab.url
    tab.wait_for_function(MOVES)


def test_clicks_in_diagram_plane_and_basins_set_what_the_machine_then_runs(
    tab: Any, folder: str
) -> None:
    opened(tab, folder)
    tab.click("#diagram-go")
    tab.wait_for_function("/400 in/.test(document.getElementById('d-diagram').textContent)")
    click_in(tab, "diagram", 0.7, 0.5)
    assert 1.0 < value(tab, "omega") < 1.8
    tab.click("#plane-go")
    tab.wait_for_function("/1-1-1/.test(document.getElementById('plane-legend').textContent)")
    click_in(tab, "plane", 0.3, 0.5)
    low, high = (float(tab.locator(f"#plane-x{end}").input_value()) for end in "01")
    assert low < value(tab, "omega") < low + 0.4 * (high - low)
    omega = value(tab, "omega")
    tab.click("#basins-go")
    tab.wait_for_function("/ a /.test(document.getElementById('basins-legend').textContent)")
    tab.click("#of-start summary")
    click_in(tab, "basins", 0.55, 0.2)
    assert value(tab, "omega") == omega
    assert value(tab, "v2") > 0.0
    assert f"{value(tab, 'v2')}&phase" in tab.url
    tab.wait_for_function(MOVES)


def test_pictures_and_tables_are_saved(tab: Any, folder: str) -> None:
    opened(tab, folder)
    tab.wait_for_function(MOVES)
    tab.click("#diagram-go")
    tab.wait_for_function("/400 in/.test(document.getElementById('d-diagram').textContent)")
    for panel in ("motion", "history", "section", "diagram", "plane", "basins"):
        assert saved(tab, f"{panel}-png").startswith(b"\x89PNG")
        svg = saved(tab, f"{panel}-svg").decode()
        assert svg.startswith("<svg ")
        tab.evaluate("(text) => new DOMParser().parseFromString(text, 'image/svg+xml')", svg)
        assert "NaN" not in svg
    lines = saved(tab, "diagram-csv").decode().splitlines()
    assert lines[0] == "omega,impact_speed"
    assert len(lines) > 400
    assert saved(tab, "history-csv").decode().startswith("time,x1,x2\n0,")
    assert saved(tab, "section-csv").decode().startswith("phase,impact_speed,x1,x2,v1,v2\n")


def test_what_is_copied_as_python_and_as_toml_gives_the_impacts_of_the_page(
    tab: Any, folder: str, tmp_path: Path
) -> None:
    tab.context.grant_permissions(["clipboard-read", "clipboard-write"])
    opened(tab, f"{folder}#{CHAOTIC}&x=0.5,0.25&v=0.1,1e-7&phase=0.3")
    tab.locator("#speed").fill("2")
    tab.wait_for_function(
        "parseFloat(document.getElementById('d-history').textContent.slice(4)) > 60", timeout=120000
    )
    tab.click("#run")
    page_has = [line.split(",") for line in saved(tab, "motion-csv").decode().splitlines()[1:]]
    tab.click("#python")
    program = dict[str, Any]()
    exec(tab.evaluate("navigator.clipboard.readText()"), program)  # noqa: S102
    tab.click("#toml")
    path = tmp_path / "machine.toml"
    path.write_text(tab.evaluate("navigator.clipboard.readText()"))
    of_file = vi.simulate(vi.load_machine(path), vi.load_start(path), impacts=len(page_has))
    assert len(page_has) > 5
    for run in (program["run"], of_file):
        assert [float(row[0]) for row in page_has] == list(run.time[: len(page_has)])
        assert [float(row[3]) for row in page_has] == list(-run.rate_before[: len(page_has)])


def test_a_link_brings_machine_parameters_and_start_back(tab: Any, folder: str) -> None:
    opened(tab, folder)
    tab.locator("#f-omega").fill("0.9")
    tab.locator("#f-omega").press("Enter")
    tab.click("#of-start summary")
    tab.locator("#f-x2").fill("0.125")
    tab.locator("#f-x2").press("Enter")
    link = tab.url
    again = opened(tab.context.new_page(), link)
    assert again.url == link
    assert value(again, "omega") == 0.9
    assert value(again, "x2") == 0.125


def test_what_a_link_says_wrongly_is_named_and_left_out(tab: Any, folder: str) -> None:
    opened(tab, f"{folder}#machine=bouncing-ball&nonsense=1&omega=fast")
    said = tab.locator("#say").text_content()
    assert said == "Left out of the link: nonsense=1, omega=fast."
    other = opened(tab.context.new_page(), f"{folder}#machine=teapot")
    assert "teapot" in other.locator("#say").text_content()
    assert other.locator("#machine").input_value() == "impact-damper"


def test_a_machine_that_chatters_goes_on(tab: Any, folder: str) -> None:
    opened(tab, f"{folder}#machine=bouncing-ball&restitution=0.3")
    tab.wait_for_function(MOVES)
    tab.locator("#speed").fill("2")
    tab.wait_for_function(
        "parseFloat(document.getElementById('d-history').textContent.slice(4)) > 20"
    )
    assert tab.locator("#say").text_content() == ""


def test_a_browser_without_relaxed_simd_takes_the_other_module(browser: Any, folder: str) -> None:
    one = browser.new_page()
    one.add_init_script(OLDER)
    opened(one, folder)
    assert one.evaluate("document.body.dataset.kernel") == "plain"
    one.wait_for_function(MOVES)
    one.close()


def test_frames_are_short_while_a_plane_is_computed_within_its_time(
    browser: Any, folder: str
) -> None:
    one = browser.new_page()
    one.add_init_script(FRAMES)
    opened(one, f"{folder}#{SET_A}&omega=1.2")
    before = cpu_seconds()
    one.evaluate("frames_ms.length = 0")
    one.click("#plane-go")
    one.wait_for_function(
        "/40000 in/.test(document.getElementById('d-plane').textContent)", timeout=300000
    )
    assert_short_frames(one)
    if before:  # processors may be shared with others: what the busier of two workers took itself
        workers = {one: spent - before.get(one, 0.0) for one, spent in cpu_seconds().items()}
        assert max(workers.values()) < PLANE_SECONDS
    one.close()


def assert_short_frames(tab: Any) -> None:
    """By the clock, also where other programs take the processors: so not of every frame."""
    tab.wait_for_function("frames_ms.length > 20")
    frames = sorted(tab.evaluate("frames_ms"))
    allowed = (
        len(frames) // 2
        if os.getloadavg()[0] > 2.0 * (os.cpu_count() or 1)
        else int(0.95 * len(frames))
    )
    assert frames[allowed] < FRAME_MS


def points(tab: Any) -> int:
    """How many the section has."""
    return int(
        tab.evaluate(
            "parseInt(document.getElementById('d-section').textContent.replaceAll(',', ''))"
        )
    )


def wait_for_points(tab: Any, count: int) -> None:
    tab.wait_for_function(
        "count => parseInt(document.getElementById('d-section').textContent.replaceAll(',', '')) >= count",
        arg=count, timeout=120000,
    )  # fmt: skip


def axes(svg: str) -> np.ndarray:
    """Scale and shift of the section's axes, by the first and the last of their labels: rows for x and y."""
    found = re.findall(
        r'<text x="([\d.]+)" y="([\d.]+)" .*?text-anchor="(\w+)".*?>(.*?)</text>', svg
    )
    rows = []
    for anchor, place, shift in (("middle", 0, 0.0), ("end", 1, 0.35 * 11.0)):
        labels = [(float(one[3]), float(one[place]) - shift) for one in found if one[2] == anchor]
        (a, at), (b, to) = labels[0], labels[-1]
        rows.append(((to - at) / (b - a), at - a * (to - at) / (b - a)))
    return np.array(rows)


def assert_picture_of_the_points(tab: Any) -> None:
    """The saved picture has the points of the saved table and is darker where more of them are, and empty elsewhere."""
    table = np.genfromtxt(
        saved(tab, "section-csv").decode().splitlines(), delimiter=",", names=True
    )
    (sx, ox), (sy, oy) = axes(saved(tab, "section-svg").decode())
    picture = plt.imread(BytesIO(saved(tab, "section-png")))[..., :3]
    height, width = picture.shape[:2]
    dark = 1.0 - picture[7 : height - 23, 47 : width - 9].mean(axis=2)  # between the axes
    x, y = sx * table["phase"] + ox - 47.0, sy * table["v2"] + oy - 7.0
    seen = (x > 1.0) & (x < dark.shape[1] - 2.0) & (y > 1.0) & (y < dark.shape[0] - 2.0)
    counts = np.zeros(dark.shape, dtype=int)
    np.add.at(counts, (y[seen].astype(int), x[seen].astype(int)), 1)
    near = sum(np.roll(counts, (i, j), (0, 1)) for i in (-1, 0, 1) for j in (-1, 0, 1))
    lit = dark > 0.3  # grid lines are fainter
    assert seen.sum() > 1000
    assert (
        lit[counts > 0].mean() > 0.99
    )  # labels stand within a hundredth of a pixel: some points a pixel off
    assert (lit & (near == 0)).sum() < 0.1 * lit.sum()  # where only earlier points are
    assert (
        dark[counts > np.quantile(counts[counts > 0], 0.9)].mean() > dark[counts == 1].mean() + 0.05
    )


def test_the_section_grows_to_millions_of_points_and_zooms_without_computing_them_again(
    browser: Any, folder: str
) -> None:
    one = browser.new_page(color_scheme="light")
    one.add_init_script(FRAMES)
    opened(one, f"{folder}#{CHAOTIC}")
    wait_for_points(one, 1000)
    one.evaluate("frames_ms.length = 0")  # the first has compiled the shaders
    wait_for_points(one, 2_000_000)
    assert_short_frames(one)
    one.click("#run")
    assert_picture_of_the_points(one)
    whole, reached = axes(saved(one, "section-svg").decode()), points(one)
    one.locator("#section").focus()
    for _ in range(3):
        one.keyboard.press("+")
    one.evaluate("frames_ms.length = 0")
    assert_short_frames(one)
    zoomed = axes(saved(one, "section-svg").decode())
    assert zoomed[0, 0] == pytest.approx(whole[0, 0] * 1.25**3, rel=1e-2)
    assert points(one) >= reached
    assert_picture_of_the_points(one)
    box = one.locator("#section").bounding_box()
    one.mouse.move(box["x"] + 200.0, box["y"] + 100.0)
    one.mouse.down()
    one.mouse.move(box["x"] + 240.0, box["y"] + 100.0, steps=2)
    one.mouse.up()
    one.wait_for_timeout(300)
    moved = axes(saved(one, "section-svg").decode())
    assert moved[0] == pytest.approx([zoomed[0, 0], zoomed[0, 1] + 40.0], rel=1e-2, abs=1.0)
    one.mouse.dblclick(box["x"] + 200.0, box["y"] + 100.0)
    one.wait_for_timeout(300)
    assert axes(saved(one, "section-svg").decode())[0] == pytest.approx(whole[0], rel=1e-2)
    one.locator("#f-omega").fill("0.45")
    one.locator("#f-omega").press("Enter")
    one.wait_for_function(
        "parseInt(document.getElementById('d-section').textContent.replaceAll(',', '')) < 2000000"
    )
    one.close()


def test_without_webgl_the_latest_points_are_drawn_and_the_page_says_so(
    browser: Any, folder: str
) -> None:
    one = browser.new_page(color_scheme="light")
    one.add_init_script(NO_WEBGL)
    opened(one, f"{folder}#{CHAOTIC}")
    wait_for_points(one, 20000)
    assert "no WebGL 2: the latest 10,000 are drawn" in one.locator("#d-section").text_content()
    picture = plt.imread(BytesIO(saved(one, "section-png")))[..., :3]
    assert ((1.0 - picture[7:-23, 47:-9].mean(axis=2)) > 0.3).sum() > 500
    one.close()


def test_a_section_whose_graphics_processor_is_taken_away_begins_again(
    browser: Any, folder: str
) -> None:
    one = browser.new_page(color_scheme="light")
    one.add_init_script(SEEN_WEBGL)
    opened(one, f"{folder}#{CHAOTIC}")
    wait_for_points(one, 20000)
    one.evaluate("window.first = webgl; webgl.getExtension('WEBGL_lose_context').loseContext()")
    one.wait_for_function("webgl !== first")
    wait_for_points(one, 20000)
    assert_picture_of_the_points(one)
    one.close()


def cpu_seconds() -> dict[str, float]:
    """Processor time of every worker of a page, by its thread, where the system tells it: on Linux."""
    found = dict[str, float]()
    for stat in Path("/proc").glob("[0-9]*/task/[0-9]*/stat"):
        try:
            name, fields = stat.read_text().rsplit(")", 1)
        except OSError:  # it has ended
            continue
        if name.endswith("(DedicatedWorker"):
            spent = sum(map(int, fields.split()[11:13]))
            found[str(stat)] = spent / os.sysconf("SC_CLK_TCK")
    return found


def test_a_page_that_is_served_asks_for_what_it_was_not_given(browser: Any) -> None:
    text = page.page_with({"bouncing-ball": machine_data(BALL)}, "bouncing-ball", {})
    with page.Server(text, {"bouncing-ball": BALL}) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        one = opened(browser.new_page(), server.address)
        one.evaluate("location.hash = 'machine=bouncing-ball&restitution=-0.5'")
        one.wait_for_function("/restitution/.test(document.getElementById('say').textContent)")
        one.close()
        server.shutdown()


def test_in_another_page_the_state_is_set_and_told(tab: Any, tmp_path: Path) -> None:
    text = page.page_with({"bouncing-ball": machine_data(BALL)}, "bouncing-ball")
    code = page.PAGE.with_name("embed.js").read_text().replace("export function", "function")
    quoted = json.dumps(text).replace("</", "<\\/")
    host = f"""<!doctype html><div id="here"></div><script type="module">{code}
        window.states = [];
        const given = {{ state: {{ values: {{ restitution: 0.5 }} }}, panels: ["motion", "controls"],
                         answer: async (question) => ({{ refused: `asked for ${{question.values.restitution}}` }}) }};
        window.explorer = mount(document.getElementById("here"), {quoted}, given);
        explorer.onState((state) => states.push(state));
        </script>"""
    (tmp_path / "host.html").write_text(host)
    tab.goto((tmp_path / "host.html").as_uri())
    tab.wait_for_function("states.at(-1)?.values.restitution === 0.5")
    inner = tab.frame_locator("iframe")
    assert not inner.locator("#plane").is_visible()
    inner.locator("#f-omega").fill("1.25")
    inner.locator("#f-omega").press("Enter")
    tab.wait_for_function("states.at(-1).values.omega === 1.25")
    tab.evaluate("explorer.setState({ start: { v: [0.75] } })")
    tab.wait_for_function("states.at(-1).start.v[0] === 0.75")
    assert tab.evaluate("states.at(-1)")["values"]["restitution"] == 0.5
    tab.evaluate("explorer.setState({ values: { restitution: -0.5 } })")
    inner.get_by_text("asked for -0.5").wait_for()
    for scheme in ("dark", "light"):  # of the other page, not of the system
        tab.emulate_media(color_scheme="light" if scheme == "dark" else "dark")
        tab.evaluate(f"document.documentElement.style.colorScheme = '{scheme}'")
        inner.locator(f"html[style='color-scheme: {scheme};']").wait_for()
        ground = inner.locator("body").evaluate("(body) => getComputedStyle(body).backgroundColor")
        assert (int(re.findall(r"\d+", ground)[0]) < 128) == (scheme == "dark")


HERE_ALONE = "http://localhost:9"  # nobody is asked there
NOTEBOOK = """<!doctype html><div id="cell"></div><script type="module">
import widget from "./script.js";
const heard = {}, traits = %s;
const page = Uint8Array.from(atob(%s), (c) => c.charCodeAt(0));
window.model = {
  get: (name) => traits[name],
  set: (name, value) => { traits[name] = value; },
  save_changes: () => { window.saved = traits.link; },
  on: (name, f) => { heard[name] = f; },
  off: (name) => { delete heard[name]; },
  send: ({ question }) => {
    const answer = new TextEncoder().encode(JSON.stringify({ refused: `asked for ${question?.values.restitution}` }));
    setTimeout(() => question ? heard["msg:custom"]({ question }, [new DataView(answer.buffer)])
                              : heard["msg:custom"]({ link: traits.link }, [new DataView(page.buffer)]));
  },
  assign: (link) => { traits.link = link; heard["change:link"](); },
};
widget.render({ model, el: document.getElementById("cell") });
</script>"""


def test_the_widget_takes_links_and_gives_those_of_the_page(browser: Any) -> None:
    pytest.importorskip("anywidget", reason="anywidget is not installed")
    damper = vi.ImpactDamper(**vi.ImpactDamper.example)
    link = link_of(replace(damper, omega=0.875), damper.free_start())
    content = page.page_with({"impact-damper": machine_data(damper)}, "impact-damper").encode()
    traits = json.dumps({"link": link, "height": 700})
    notebook = NOTEBOOK % (traits, json.dumps(base64.b64encode(content).decode()))
    script = vi.Explorer(damper).widget._esm
    tab, errors = browser.new_page(), list[str]()
    tab.on("pageerror", lambda error: errors.append(str(error)))
    tab.route(
        f"{HERE_ALONE}/", lambda route: route.fulfill(body=notebook, content_type="text/html")
    )
    tab.route(
        f"{HERE_ALONE}/script.js",
        lambda route: route.fulfill(body=script, content_type="text/javascript"),
    )
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
    behind = link_of(replace(damper, restitution=0.0), start).replace(
        "restitution=0.0", "restitution=-2"
    )
    tab.evaluate("link => model.assign(link)", behind)
    tab.frame_locator("iframe").get_by_text("asked for -2").wait_for()
    assert errors == []
