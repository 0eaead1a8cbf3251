"""The kernel of the built page has the bits of Python, and its speed, where `make explorer` and a browser are there."""

from __future__ import annotations

import itertools
import json
import math
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.chromium import a_browser

import vibroimpact as vi
from vibroimpact.explorer.page_data import catalogue, machine_data, start_of, text_of, values_of
from vibroimpact.machines.machine import Machine
from vibroimpact.model.mechanism import stop_sizes
from vibroimpact.model.parameters import with_parameters

pytestmark = pytest.mark.slow
HERE = Path(__file__).parent
BUILT = HERE.parents[1] / "web" / "build"
STARTS, SETTINGS = 200, 10  # of each machine: starts, at so many values of its parameters
IMPACTS = 40  # of each run
SINES = ("ball-harvester", "dual-component")  # NumPy's sine of a parameter is not the kernel's
SITE = "http://explorer.test"  # answered from the folders of the test


def random_runs(machine: Machine) -> Iterator[tuple[dict[str, Any], np.ndarray]]:
    """Runs of a machine from random starts, half of its parameters changed by up to 30 %."""
    random = np.random.default_rng(7)
    begin, found = start_of(machine), 0
    size, omega = max(stop_sizes(machine.mechanism), default=1.0), machine.mechanism.omega or 1.0
    for setting in itertools.count(1):
        factors = np.exp(random.uniform(-0.3, 0.3, 40) * (random.random(40) < 0.5))
        values = {k: x * f for (k, x), f in zip(values_of(machine).items(), factors, strict=False)}
        try:
            changed = with_parameters(machine, values)
        except vi.InvalidParameterError:
            continue  # a restitution above 1
        for _ in range(3 * STARTS // SETTINGS):
            if found == min(STARTS, setting * STARTS // SETTINGS):
                break
            x = np.array(begin.position) + 0.3 * size * random.normal(size=len(begin.position))
            v = size * omega * random.normal(size=len(begin.position))
            start = vi.State(tuple(x), tuple(v), random.uniform(0.0, 6.28))
            t_max = 400.0 * math.pi / omega
            try:
                run = vi.simulate(changed, start, impacts=IMPACTS, t_max=t_max)
            except vi.InvalidParameterError:
                continue  # behind a stop
            found += 1
            columns = [
                run.status, run.contact, run.limit_side, run.time, run.rate_before, run.rate_after, run.phase,
                run.position, run.velocity_before, run.velocity_after,
            ]  # fmt: skip
            rows = np.column_stack(columns)
            yield {
                "values": values, "start": {"x": [*start.position], "v": [*start.velocity], "phase": start.phase},
                "t_max": t_max, "impacts": IMPACTS, "end": int(run.end), "count": len(rows),
            }, rows  # fmt: skip
        if found == STARTS:
            return


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the catalogue, and runs of its machines."""
    if not (BUILT / "data.mjs").exists():
        pytest.skip("The page is not built: make explorer")
    folder = tmp_path_factory.mktemp("runs")
    machines = {k: m for k, m in catalogue().items() if k not in SINES}
    data = {name: machine_data(machine) for name, machine in machines.items()}
    runs = {name: [*random_runs(machine)] for name, machine in machines.items()}
    (folder / "machines.json").write_text(text_of(data, "impact-damper", {}))
    (folder / "runs.json").write_text(
        json.dumps({k: [run for run, _ in v] for k, v in runs.items()})
    )
    (folder / "numbers").write_bytes(
        b"".join(rows.tobytes() for v in runs.values() for _, rows in v)
    )
    return folder


@pytest.fixture(scope="module")
def site(written: Path) -> Iterator[Any]:
    """An empty page that can import the built modules and read the runs."""
    kinds = {".mjs": "text/javascript", ".wasm": "application/wasm", ".html": "text/html"}

    def answer(route: Any) -> None:
        name = route.request.url.rpartition("/")[2] or "empty.html"
        found = [place / name for place in (HERE, BUILT, written) if (place / name).exists()]
        kind = kinds.get(Path(name).suffix, "application/octet-stream")
        route.fulfill(body=found[0].read_bytes() if found else b"", content_type=kind)

    with a_browser() as browser:
        tab = browser.new_page()
        tab.route(f"{SITE}/**", answer)
        tab.goto(f"{SITE}/")
        tab.evaluate(
            """async () => {
              window.modules = { ...(await import("/kernel.mjs")), ...(await import("/data.mjs")) };
              window.kernel = await modules.Kernel.of(await (await fetch("/fast.wasm")).arrayBuffer());
              window.whole = async () => await (await fetch("/machines.json")).json();
            }"""
        )
        yield tab


def test_every_machine_has_the_bits_of_python_impact_by_impact_without_an_instruction_for_fma(
    written: Path,
) -> None:
    if not shutil.which("node"):
        pytest.skip("Node.js is not installed")
    command = ["node", str(HERE / "same_bits.mjs"), str(written), str(BUILT)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    found = json.loads(done.stdout)
    assert found["differ"] == []
    assert found["compared"] > 25 * STARTS // 20 * 10


def test_every_machine_has_the_bits_of_python_impact_by_impact_in_chromium(site: Any) -> None:
    found = site.evaluate(
        """async () => {
          const { differences } = await import("/same_bits.mjs");
          const runs = await (await fetch("/runs.json")).json();
          const numbers = new Float64Array(await (await fetch("/numbers")).arrayBuffer());
          return differences(modules, kernel, await whole(), runs, numbers);
        }"""
    )
    assert found["differ"] == []
    assert found["compared"] > 25 * STARTS * 10


def test_in_chromium_a_motion_is_computed_at_a_third_of_the_native_speed_or_faster(
    site: Any,
) -> None:
    damper = vi.ImpactDamper(**vi.ImpactDamper.example)
    impacts, repeats = 10000, 30  # the shortest of many, as other programs run too
    native = list[float]()
    for _ in range(repeats):
        since = time.perf_counter()
        vi.simulate(damper, start_of(damper), impacts=impacts)
        native.append(time.perf_counter() - since)
    shortest = site.evaluate(
        """async ([impacts, repeats]) => {
          const all = await whole(), machine = all.machines["impact-damper"];
          machine.recordings = machine.recordings.map((r) => modules.unpacked(r, all.operands));
          const values = Object.fromEntries(machine.parameters.map((p) => [p.name, p.value]));
          let shortest = Infinity;
          for (let k = 0; k < repeats; ++k) {
            const since = performance.now();
            kernel.compile(machine, values, machine.start);
            kernel.begin(machine.start);
            for (let left = impacts; left > 0; ) left -= kernel.record(Infinity, left).count;
            shortest = Math.min(shortest, performance.now() - since);
          }
          return shortest / 1000;
        }""",
        [impacts, repeats],
    )
    assert shortest < 3.0 * min(native)
