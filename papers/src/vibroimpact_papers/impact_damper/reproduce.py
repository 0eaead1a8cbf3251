"""Reproduction of every figure and number of the founding paper, with a verdict on each."""

from __future__ import annotations

import copyreg
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar

import xarray as xr

from vibroimpact import _kernel
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.files import write_files
from vibroimpact._core.progress import Display
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.simulation.simulate import simulate
from vibroimpact_papers.folder import whole_folder
from vibroimpact_papers.impact_damper import (
    Panel,
    ParameterSet,
    claims,
    datasets,
    figures,
    panels,
    parameter_sets,
)
from vibroimpact_papers.impact_damper.circles import measure
from vibroimpact_papers.impact_damper.evidence import Evidence
from vibroimpact_papers.impact_damper.families import circle_fold, family_data, family_of
from vibroimpact_papers.impact_damper.findings import Findings, Pictures, Residual
from vibroimpact_papers.impact_damper.misprints import Misprint, default_case, misprints
from vibroimpact_papers.impact_damper.normal_forms import critical_points
from vibroimpact_papers.impact_damper.panel_results import (
    Followed,
    PanelResult,
    branch_orbit,
    follow_both_ways,
    panel_result,
)
from vibroimpact_papers.impact_damper.plan import Plan, damper_of
from vibroimpact_papers.impact_damper.planes import (
    MULTISTABLE,
    basin_data,
    multistable_panel,
    plane_data,
)
from vibroimpact_papers.impact_damper.resonances import (
    distances,
    resonance_data,
    resonances_of,
)
from vibroimpact_papers.impact_damper.spectra import spectrum_data
from vibroimpact_papers.impact_damper.story import TITLE, page
from vibroimpact_papers.impact_damper.story_circles import point_record
from vibroimpact_papers.impact_damper.story_resonances import strong_record
from vibroimpact_papers.impact_damper.symmetric_bifurcations import (
    Bifurcation,
    symmetric_bifurcations,
)
from vibroimpact_papers.impact_damper.transient import PANEL, survivors
from vibroimpact_papers.impact_damper.unfolding import Unfolded, unfolded, unfolding_data
from vibroimpact_papers.impact_damper.verdicts import judge
from vibroimpact_papers.judged import Claim, Summary, to_json

Item = TypeVar("Item")
Result = TypeVar("Result")

title = TITLE  # of the list of publications
WORKERS = 2  # processes
STAGES = 13
EXAMPLE_SET, EXAMPLE_PANEL = "A", "2g"  # shown as a section in the introduction
EXAMPLE_OMEGA, EXAMPLE_IMPACTS = 1.2, 9  # shown as a time history
PORTRAIT_IMPACTS = 24
PORTRAIT_PUSH = 0.1  # radians


def reproduce(out: Path, *, plan: Plan | None = None, progress: Display | None = None) -> Summary:
    """Reproduce the paper and write the report.

    Parameters
    ----------
    out
        Folder for the report: absent, empty, or an earlier report, which is replaced whole at the
        end. Its parent must exist.
    plan
        Starts, steps, settling and numbers of points; the full ones if not given.
    progress
        Progress display; on standard error if not given.

    Returns
    -------
    Summary
        The verdicts. On disk: ``report.html``, ``verdicts.json``, ``figures/``, ``data/``.

    Raises
    ------
    InvalidParameterError
        ``out`` holds foreign files or cannot be written.

    Notes
    -----
    Everything is deterministic: no random numbers, equal bits in every run.
    """
    progress = progress or Display(STAGES)
    try:
        with whole_folder(Path(out)) as work, processes(progress) as workers:
            found = compute(plan or Plan(), workers)
            progress.stage("verdicts")
            judgements = judge(evidence_of(found, claims()))
            residuals = _residuals()
            pictures = _write_figures(work, found, workers)
            progress.stage("report")
            (work / "verdicts.json").write_text(
                to_json(
                    judgements,
                    package={"vibroimpact": _kernel.version()},
                    plan=found.plan.attributes(),
                    misprints=[r.record() for r in residuals],
                    section_4=[point_record(m) for m in found.circles],
                    strong_resonances=strong_record(found),
                    transient=found.transient.record() if found.transient else {},
                ),
                encoding="utf-8",
            )
            html = page(found, judgements, residuals, pictures).__html__()
            (work / "report.html").write_text(html, encoding="utf-8")
        return Summary(Path(out), judgements)
    finally:
        progress.close()


def compute(plan: Plan, workers: Workers) -> Findings:
    """Compute bifurcations, sweeps, panels and circles."""
    sets = parameter_sets()
    chosen = [p for p in panels() if p.shows == "section" and p.figure in plan.figures]
    points = workers.map("bifurcations", partial(_bifurcations, plan), sets.values())
    ways = workers.map("following attractors", partial(_follow, plan, chosen), sets.values())
    followed = dict(zip(sets, ways, strict=True))
    beside = [(panel, followed[panel.set]) for panel in chosen]
    results = workers.map("panels", partial(_panel, plan), beside)
    bifurcated = dict(zip(sets, points, strict=True))
    critical = [c for name, found in bifurcated.items() for c in critical_points(name, found)]
    circles = workers.map("circles", partial(measure, plan=plan), critical)
    by_panel = {r.panel.name: r for r in results}
    ensembles = _ensembles(sets, by_panel, plan, workers.progress)
    long = by_panel.get(PANEL)
    transient = survivors(sets[long.panel.set], long.omega, plan) if long else None
    strong = [sets[name] for name in sets if name in plan.strong]
    resonant = workers.map("strong resonances", partial(resonances_of, plan=plan), strong)
    resonances = {one.set: one for one in resonant}
    followed_circles = workers.map(
        "families of circles", partial(family_of, results=by_panel, plan=plan), strong
    )
    chosen_points = [
        (sets[name], point)
        for name, kind, omega in plan.unfolded
        if name in resonances and (point := resonances[name].named(kind, omega))
    ]
    unfoldings = workers.map("portraits around resonances", _unfolded, chosen_points)
    routes = [(one, followed[one.name], bifurcated[one.name]) for one in strong]
    spectra = workers.map("Lyapunov spectra", partial(_spectrum, plan), routes)
    families = {one.set: one for one in followed_circles if one}
    folds = {
        m.point.name: fold
        for m in circles
        if m.point.form.warnings
        and m.point.form.attracting
        and m.point.set in families
        and (fold := circle_fold(sets[m.point.set], m.point.omega, m.point.form.side))
    }
    away = {
        name: distances(one, sets[name], claims(), bifurcated[name])
        for name, one in resonances.items()
    }
    return Findings(
        plan, sets, bifurcated, followed, by_panel, tuple(circles), ensembles, transient,
        resonances, away, families, tuple(unfoldings), tuple(spectra),
        folds,
    )  # fmt: skip


def _bifurcations(plan: Plan, one: ParameterSet) -> tuple[Bifurcation, ...]:
    (low, high), sweep = one.omega_range, plan.sweeps[one.name]
    span = min(low, sweep.low), max(high, sweep.high)
    return symmetric_bifurcations(damper_of(one, span[1]), span)


def _follow(plan: Plan, chosen: list[Panel], one: ParameterSet) -> Followed:
    omegas = tuple(p.omega for p in chosen if p.set == one.name and isinstance(p.omega, float))
    return follow_both_ways(one, plan, omegas)


def _panel(plan: Plan, beside: tuple[Panel, Followed]) -> PanelResult:
    panel, followed = beside
    return panel_result(parameter_sets()[panel.set], panel, followed, plan)


def _unfolded(pair: tuple[ParameterSet, BifurcationPoint]) -> Unfolded:
    return unfolded(*pair)


def _spectrum(
    plan: Plan, route: tuple[ParameterSet, Followed, tuple[Bifurcation, ...]]
) -> xr.Dataset:
    one, followed, bifurcations = route
    begin = [p.omega for p in bifurcations if p.kind == "NS" and p.admissible]
    return spectrum_data(one, followed, max(begin), plan)


def _ensembles(
    sets: Mapping[str, ParameterSet], results: Mapping[str, PanelResult], plan: Plan,
    progress: Display,
) -> dict[str, xr.Dataset]:  # fmt: skip
    """Compute the plane of each set, and basins at a frequency where attractors coexist."""
    panel = multistable_panel(results)

    def made() -> Iterator[xr.Dataset]:  # one after the other: each uses every core
        yield from (plane_data(chosen, plan) for chosen in sets.values())
        if panel:
            yield basin_data(sets[MULTISTABLE], plan, panel.omega)

    found = progress.track("planes and basins", made(), len(sets) + bool(panel))
    return {str(data.attrs["figure"]): data for data in found}


def evidence_of(found: Findings, chosen: tuple[Claim, ...]) -> Evidence:
    """Return the evidence for the verdicts."""
    return Evidence(
        found.sets, chosen, found.bifurcations, found.panels, found.circles, found.resonances,
        found.families,
    )  # fmt: skip


def _frozen(table: dict[Any, Any]) -> MappingProxyType[Any, Any]:
    """A table that nobody changes, which pickle does not know."""
    return MappingProxyType(table)


copyreg.pickle(MappingProxyType, lambda table: (_frozen, (dict(table),)))


class Workers(NamedTuple):
    """Processes that share the work of a stage."""

    pool: ProcessPoolExecutor
    progress: Display

    def map(self, name: str, work: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
        """Map over items, in order."""
        todo = list(items)
        return list(self.progress.track(name, self.pool.map(work, todo), len(todo)))


@contextmanager
def processes(progress: Display) -> Iterator[Workers]:
    """Processes until all is done; an interruption or an error ends them at once.

    Raises
    ------
    InvalidParameterError
        A process could not begin, or was ended from outside.
    """
    others = multiprocessing.active_children()
    pool = ProcessPoolExecutor(
        min(WORKERS, os.cpu_count() or 1), multiprocessing.get_context("spawn"),
        signal.signal, (signal.SIGINT, signal.SIG_IGN),
    )  # fmt: skip
    try:
        yield Workers(pool, progress)
    except BaseException as error:
        for child in multiprocessing.active_children():
            if child not in others:
                child.terminate()
        if isinstance(error, BrokenProcessPool):
            raise InvalidParameterError(
                "reproduce: one of its processes was ended, or could not begin. A script that calls it begins with "
                "if __name__ == '__main__':, since each process reads the script once more."
            ) from error
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _residuals() -> tuple[Residual, ...]:
    """Evaluate every misprint as printed and as corrected."""
    case = default_case()

    def one(m: Misprint) -> Residual:
        return Residual(m, m.residual_printed(case), m.residual_corrected(case))

    return tuple(one(m) for m in misprints())


# --- figures --------------------------------------------------------------------------------------


def _write_figures(work: Path, found: Findings, workers: Workers) -> Pictures:
    """Write the data, and draw every figure from the files just written."""
    (work / "figures").mkdir()
    (work / "data").mkdir()
    names: dict[str, tuple[str, ...]] = {}
    for figure, parts in workers.progress.track("data", _all_data(found), _count(found)):
        names[figure] = tuple(_write(work / "data", data) for data in parts)
    workers.map("figures", partial(_draw, work), _of_figures(names))
    return Pictures(work / "figures", names)


def _draw(work: Path, named: tuple[str, tuple[str, ...]]) -> None:
    """Draw a figure from its files."""
    figure, files = named
    data = tuple(figures.open_data(work / "data" / name) for name in files)
    figures.save_both(figures.redraw(data), work / "figures" / figure)


def _of_figures(names: dict[str, tuple[str, ...]]) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Leave out tables, which have no figure."""
    yield from ((f, files) for f, files in names.items() if not f.startswith("bifurcations"))


def _write(folder: Path, data: xr.Dataset) -> str:
    figure = str(data.attrs["figure"])
    name = figure if figure != "none" else f"bifurcations-{data.attrs['set']}"
    numeric = [key for key, variable in data.data_vars.items() if variable.dtype.kind in "fi"]
    packed = {key: {"zlib": True} for key in numeric}
    content = bytes(data.to_netcdf(engine="h5netcdf", encoding=packed))
    write_files({folder / f"{name}.nc": content})
    return f"{name}.nc"


def _count(found: Findings) -> int:
    return sum(1 for _ in _all_data(found, names_only=True))


def _all_data(
    found: Findings, *, names_only: bool = False
) -> Iterator[tuple[str, tuple[xr.Dataset, ...]]]:
    """Yield (figure, its datasets), computing only the requested ones."""
    makers = _makers(found)
    for figure, make in makers.items():
        yield figure, () if names_only else make()


def _makers(found: Findings) -> dict[str, Callable[[], tuple[xr.Dataset, ...]]]:
    """Map each figure to the function that makes its data."""
    sets, plan = found.sets, found.plan
    example = sets[EXAMPLE_SET]
    makers: dict[str, Callable[[], tuple[xr.Dataset, ...]]] = {
        "mechanism": lambda: (_example(found, "mechanism", 1),),
        "history": lambda: (_example(found, "history", EXAMPLE_IMPACTS),),
        "portrait": lambda: (_example(found, "portrait", PORTRAIT_IMPACTS),),
    }
    if EXAMPLE_PANEL in found.panels:
        shown = (found.panels[EXAMPLE_PANEL],)
        makers["section"] = lambda: (datasets.panel_data("section", example, plan, shown),)
    makers["multipliers-A"] = lambda: (datasets.multiplier_data(example, plan),)
    makers["circles"] = lambda: tuple(
        datasets.circle_data(sets[m.point.set], plan, m) for m in found.circles
    )
    for figure in plan.figures:
        makers[f"figure-{figure}"] = lambda figure=figure: _paper_figure(found, figure)  # type: ignore[misc]
    for name, one in found.resonances.items():
        makers[f"strong-{name}"] = lambda one=one: resonance_data(  # type: ignore[misc]
            one, sets[one.set], plan, claims()
        )
    for name, one_family in found.families.items():
        makers[f"families-{name}"] = lambda one=one_family: (  # type: ignore[misc]
            family_data(one, sets[one.set], found.panels, plan),
        )
    for i, each in enumerate(found.unfolded, 1):
        makers[f"unfolding-{each.set}-{i}"] = lambda i=i, each=each: (  # type: ignore[misc]
            unfolding_data(each, i, sets[each.set], plan),
        )
    if found.spectra:
        makers["spectra"] = lambda: found.spectra
    for figure, data in found.ensembles.items():
        makers[figure] = lambda data=data: (data,)  # type: ignore[misc]
    for name in sets:
        makers[f"diagram-{name}"] = lambda name=name: (  # type: ignore[misc]
            datasets.diagram_data(sets[name], plan, found.followed[name]),
        )
        makers[f"bifurcations-{name}"] = lambda name=name: (  # type: ignore[misc]
            datasets.bifurcation_data(sets[name], plan, found.bifurcations[name]),
        )
    return makers


def _paper_figure(found: Findings, figure: str) -> tuple[xr.Dataset, ...]:
    rows = [p for p in panels() if p.figure == figure]
    if rows[0].shows == "multipliers":
        return tuple(datasets.multiplier_data(found.sets[p.set], found.plan) for p in rows)
    chosen = found.sets[rows[0].set]
    results = [found.panels[p.name] for p in rows]
    return (datasets.panel_data(f"figure-{figure}", chosen, found.plan, results),)


def _example(found: Findings, figure: str, impacts: int) -> xr.Dataset:
    """Simulate the stable orbit of set A, disturbed so that it settles visibly."""
    chosen = found.sets[EXAMPLE_SET]
    orbit = branch_orbit(chosen, EXAMPLE_OMEGA)
    assert orbit is not None
    start = orbit.state.perturbed(PORTRAIT_PUSH) if figure == "portrait" else orbit.state
    run = simulate(damper_of(chosen, EXAMPLE_OMEGA), start, impacts=impacts)
    return datasets.run_data(figure, chosen, found.plan, run, impacts)
