"""What an observer costs: a header, its line in the registry, and a file in Python."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import fields
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from support.builds import FLAGS, INCLUDE, ROOT
from support.changed_package import package_copy, run_with
from support.members import Case, impacts_in_window
from support.systems import ball, paper_damper

import vibroimpact as vi
from vibroimpact import _kernel
from vibroimpact.sweeps.observers.table import OBSERVERS

SPEEDS = [1.3, -1.2]
HEADER = """
// Times between impacts, all stops together.
#pragma once

#include "vibroimpact/observe/observer.hpp"

namespace vi::observe {

struct pauses {
    static constexpr const char* name = "pauses";
    double least = 0.0;
    result_table statistics{}; // how many are at least so long; the longest

    void options(const auto& to) { to.real("least", least); }
    void tables(const batch_sizes&, const auto& to) { to("statistics", statistics, 2); }

    template <class Flow>
    struct observer {
        double least = 0.0, last = -1.0, longest = 0.0;
        long count = 0;

        VI_HD void prepare(const pauses& options, const member_start<Flow>&) {
            least = options.least;
        }
        VI_HD void on_event(const event_view<Flow>& s) {
            if (!counts_as_impact(s.e.what)) return;
            if (last >= 0.0) {
                count += s.time - last >= least;
                longest = max(longest, s.time - last);
            }
            last = s.time;
        }
        VI_HD void write(const auto& m, const pauses& to) const {
            to.statistics.put(m.row, count, longest);
        }
    };
};

} // namespace vi::observe
"""
MODULE = '''
"""Pauses: times between impacts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import Observer, Variables, real, whole


@dataclass(frozen=True, kw_only=True)
class Pauses(Observer):
    """How many pauses are at least so long, and the longest."""

    name: ClassVar[str] = "pauses"
    least: float = 1.0

    def variables(self, mechanism: Mechanism) -> Variables:
        """``pauses``, ``pause_longest``."""
        longest = real("statistics", "longest pause", slice(1, 2), quantity="time")
        return {"pauses": whole("statistics", "pauses", 0, "int32"), "pause_longest": longest}
'''
CHILD = """
import json, sys
from support import batch_program
from vibroimpact import _kernel

_kernel.Batch, _kernel.observers = batch_program.Batch, batch_program.observers

import vibroimpact as vi
from support.systems import paper_damper

ROWS = ["dashpots", vi.observe.Harmonic(row=(0.0, 0.0, 1.0, -1.0), label="v", harmonic=3.0),
        vi.observe.Rms(row=(0.0, 0.0, 0.0, 0.0, 1.0, 0.0), label="a"), "harmonic"]
starts = vi.GridStarts({"v2": [1.3, -1.2]}, vi.State((0.0, 0.0), (0.0, 1.0)))
found = vi.sweep(
    paper_damper("B", 0.96, restitution=0.5), over={}, start=starts, settle_periods=5, periods=60,
    observe=["pauses", vi.observe.Section(points=3, stop="B"), "symbol", "extremes", "settling",
             "lyapunov", "final", *ROWS] if len(sys.argv) < 2 else vi.observe.Pauses(least=sys.argv[1]),
    progress=False,
)
print(json.dumps({name: found[name].values.tolist() for name in found.data_vars}))
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Headers and package with an observer more, and the program compiled with it."""
    folder = tmp_path_factory.mktemp("observer")
    observe = Path("vibroimpact/observe")
    shutil.copytree(INCLUDE, folder / "include")
    (folder / "include" / observe / "pauses.hpp").write_text(HEADER)
    registry = folder / "include" / observe / "registry.hpp"
    listed = registry.read_text()
    first = f'#include "{observe}/extremes.hpp"\n'
    assert first in listed
    last = re.search(r"(observe::\w+)>;", listed)
    assert last
    listed = listed.replace(first, f'{first}#include "{observe}/pauses.hpp"\n')
    listed = listed.replace(last[0], f"{last[1]}, observe::pauses>;")
    registry.write_text(listed)

    package = package_copy(folder)
    (package / "sweeps" / "observers" / "pauses.py").write_text(MODULE)

    flags = [flag for flag in FLAGS if flag != f"-I{INCLUDE}"] + [f"-I{folder / 'include'}"]
    source = str(ROOT / "tests" / "cpp" / "batch_program.cpp")
    subprocess.run(["g++", "-O0", *flags, source, "-o", str(folder / "program")], check=True)
    return folder


def swept(copy: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A sweep in the copy, run by the program."""
    return run_with(copy, CHILD, *arguments, BATCH_PROGRAM=str(copy / "program"))


@pytest.mark.slow
def test_an_observer_is_added_by_a_header_its_line_in_the_registry_and_a_file(copy: Path) -> None:
    done = swept(copy)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    damper = paper_damper("B", 0.96, restitution=0.5)
    period = 2.0 * np.pi / damper.omega
    for i, v2 in enumerate(SPEEDS):
        start = vi.State((0.0, 0.0), (0.0, v2))
        case = Case(damper, start, 5 * period, 60 * period)
        record = case.record()
        pauses = np.diff(record.time[impacts_in_window(case, record)])
        assert len(pauses) > 40
        assert found["pauses"][i] == np.count_nonzero(pauses >= 1.0)
        assert found["pause_longest"][i] == pauses.max()


@pytest.mark.slow
def test_the_others_have_the_bits_of_the_installed_kernel_beside_it(copy: Path) -> None:
    found = json.loads(swept(copy).stdout)
    here = vi.sweep(
        paper_damper("B", 0.96, restitution=0.5), over={}, settle_periods=5,
        start=vi.GridStarts({"v2": SPEEDS}, vi.State((0.0, 0.0), (0.0, 1.0))),
        observe=[vi.observe.Section(points=3, stop="B"), "symbol", "extremes", "settling",
                 "lyapunov", "final", "dashpots", "harmonic",
                 vi.observe.Harmonic(row=(0.0, 0.0, 1.0, -1.0), label="v", harmonic=3.0),
                 vi.observe.Rms(row=(0.0, 0.0, 0.0, 0.0, 1.0, 0.0), label="a")],
        periods=60, progress=False,
    )  # fmt: skip
    assert {*found} == {*here.data_vars, "pauses", "pause_longest"}
    for name in here.data_vars:
        np.testing.assert_array_equal(here[name], found[name], err_msg=str(name))


@pytest.mark.slow
def test_its_options_are_checked_as_its_header_says(copy: Path) -> None:
    refused = swept(copy, "long")
    assert refused.returncode == 1
    assert "InvalidParameterError: least = 'long': must be a finite number" in refused.stderr


@pytest.mark.parametrize("name", ["shares", "settling", "spectrum", "speeds", "stroboscopic"])
def test_no_other_file_declares_an_observer(name: str) -> None:
    """Others may use one, as planes use sections; they do not list what there is."""
    declared = re.compile(
        rf"observe::{name}\b|observe/{name}\.hpp|(struct|class) {name}\b(?!_)", re.I
    )
    found = {
        str(path.relative_to(ROOT))
        for folder in ("include", "src")
        for path in (ROOT / folder).rglob("*.[hpc]*")
        if path.suffix in {".hpp", ".cpp", ".py"} and declared.search(path.read_text())
    }
    assert found == {
        f"include/vibroimpact/observe/{name}.hpp",
        "include/vibroimpact/observe/registry.hpp",
        f"src/vibroimpact/sweeps/observers/{name}.py",
    }


@pytest.mark.parametrize("name", OBSERVERS)
def test_both_sides_of_an_observer_have_the_same_options_and_tables(name: str) -> None:
    options, tables = _kernel.observers()[name]
    kind = OBSERVERS[name]
    own = {f.name for f in fields(cast(Any, kind))} - {"label"}
    assert own == {option.replace("rows", "row") for option in options}
    stop = {"stop": "B"} if "stop" in own else {}
    system = (
        ball(0.5) if name not in {"stroboscopic", "harmonic"} else paper_damper("A", 1.2).mechanism
    )
    assert {v.table for v in kind(**stop).variables(system).values()} == {*tables}
