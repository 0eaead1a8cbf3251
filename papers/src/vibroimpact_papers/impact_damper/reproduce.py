"""Reproduction of every figure and number of the founding paper, with a verdict on each."""

from __future__ import annotations

import copyreg
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
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
from vibroimpact.model.state import State
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
from vibroimpact_papers.impact_damper.circles import Measured, measure
from vibroimpact_papers.impact_damper.evidence import Evidence
from vibroimpact_papers.impact_damper.families import Family, circle_fold, family_data, family_of
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
Maker = Callable[[], xr.Dataset | tuple[xr.Dataset, ...]]
Begun = Mapping[str, Future[tuple[str, ...]]]  # by figure the names of its files

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
            begun = _write_figures(work, found, workers)
            progress.stage("verdicts")
            judgements = judge(evidence_of(found, claims()))
            residuals = _residuals()
            files = workers.results("data and figures", [*begun.values()])
            pictures = Pictures(work / "figures", dict(zip(begun, files, strict=True)))
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
    """Compute bifurcations, sweeps, panels and circles.

    What is long is begun first, and all as soon as what it needs is known: no process waits for the end of a stage.
    """
    sets, begin, results = parameter_sets(), workers.begin, workers.results
    strong = [sets[name] for name in sets if name in plan.strong]
    chosen = [p for p in panels() if p.shows == "section" and p.figure in plan.figures]
    ways = begin(partial(_follow, plan, chosen), sets.values())
    points = begin(partial(_bifurcations, plan), sets.values())
    resonant = begin(partial(resonances_of, plan=plan), strong)

    followed = dict(zip(sets, results("following attractors", ways), strict=True))
    shown = begin(partial(_panel, plan), [(p, followed[p.set].states(p)) for p in chosen])
    bifurcated = dict(zip(sets, results("bifurcations", points), strict=True))
    critical = [c for name, found in bifurcated.items() for c in critical_points(name, found)]
    measured = begin(partial(measure, plan=plan), critical)

    resonances = {one.set: one for one in results("strong resonances", resonant)}
    unfoldings = begin(_unfolded, [
        (sets[name], point)
        for name, kind, omega in plan.unfolded
        if name in resonances and (point := resonances[name].named(kind, omega))
    ])  # fmt: skip
    by_panel = {r.panel.name: r for r in results("panels", shown)}
    of_set = {name: {n: r for n, r in by_panel.items() if r.panel.set == name} for name in sets}
    families = begin(partial(_family, plan), [(one, of_set[one.name]) for one in strong])
    several = multistable_panel(by_panel)
    planes = begin(partial(plane_data, plan=plan), sets.values())
    if several:
        planes += begin(partial(_basins, plan), [several.omega])
    circles = results("circles", measured)
    folds = begin(_fold, [
        (sets[m.point.set], m.point.omega, m.point.form.side)
        for m in circles if _ends_nearby(m, strong)
    ])  # fmt: skip
    routes = [(one, followed[one.name], bifurcated[one.name]) for one in strong]
    spectra = begin(partial(_spectrum, plan), routes)

    long = by_panel.get(PANEL)
    transient = survivors(sets[long.panel.set], long.omega, plan) if long else None
    away = {
        name: distances(one, sets[name], claims(), bifurcated[name])
        for name, one in resonances.items()
    }
    around = tuple(results("portraits around resonances", unfoldings))
    by_set = {one.set: one for one in results("families of circles", families) if one}
    ensembles = {str(d.attrs["figure"]): d for d in results("planes and basins", planes)}
    ending = [m.point for m in circles if _ends_nearby(m, strong)]
    ends = zip(ending, results("folds of circles", folds), strict=True)
    return Findings(
        plan, sets, bifurcated, followed, by_panel, tuple(circles), ensembles, transient,
        resonances, away, by_set, around, tuple(results("Lyapunov spectra", spectra)),
        {point.name: fold for point, fold in ends if fold and point.set in by_set},
    )  # fmt: skip


def _ends_nearby(one: Measured, strong: Sequence[ParameterSet]) -> bool:
    """Whether circles that attract are born next to a strong resonance, of a set in which families are followed."""
    form = one.point.form
    followed = any(one.point.set == each.name for each in strong)
    return bool(form.warnings and form.attracting and followed)


def _bifurcations(plan: Plan, one: ParameterSet) -> tuple[Bifurcation, ...]:
    (low, high), sweep = one.omega_range, plan.sweeps[one.name]
    span = min(low, sweep.low), max(high, sweep.high)
    return symmetric_bifurcations(damper_of(one, span[1]), span)


def _follow(plan: Plan, chosen: list[Panel], one: ParameterSet) -> Followed:
    omegas = tuple(p.omega for p in chosen if p.set == one.name and isinstance(p.omega, float))
    return follow_both_ways(one, plan, omegas)


def _panel(plan: Plan, beside: tuple[Panel, Mapping[str, State]]) -> PanelResult:
    panel, reached = beside
    return panel_result(parameter_sets()[panel.set], panel, reached, plan)


def _family(plan: Plan, beside: tuple[ParameterSet, Mapping[str, PanelResult]]) -> Family | None:
    return family_of(*beside, plan)


def _fold(beside: tuple[ParameterSet, float, int]) -> BifurcationPoint | None:
    return circle_fold(*beside)


def _basins(plan: Plan, omega: float) -> xr.Dataset:
    return basin_data(parameter_sets()[MULTISTABLE], plan, omega)


def _unfolded(pair: tuple[ParameterSet, BifurcationPoint]) -> Unfolded:
    return unfolded(*pair)


def _spectrum(
    plan: Plan, route: tuple[ParameterSet, Followed, tuple[Bifurcation, ...]]
) -> xr.Dataset:
    one, followed, bifurcations = route
    begin = [p.omega for p in bifurcations if p.kind == "NS" and p.admissible]
    return spectrum_data(one, followed, max(begin), plan)


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

    def begin(self, work: Callable[[Item], Result], items: Iterable[Item]) -> list[Future[Result]]:
        """Begin the work on every item, after all that was begun before."""
        return [self.pool.submit(work, item) for item in items]

    def results(self, name: str, begun: Sequence[Future[Result]]) -> list[Result]:
        """Wait for what was begun, in order, as a stage."""
        return list(self.progress.track(name, (one.result() for one in begun), len(begun)))


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


def _write_figures(work: Path, found: Findings, workers: Workers) -> Begun:
    """Begin to write the data of every figure, and to draw it from the files just written."""
    (work / "figures").mkdir()
    (work / "data").mkdir()
    makers = _makers(found)
    return dict(zip(makers, workers.begin(partial(_draw, work), makers.items()), strict=True))


def _draw(work: Path, named: tuple[str, Maker]) -> tuple[str, ...]:
    """Write the data of a figure, draw it from its files and return their names; tables have no figure."""
    figure, make = named
    made = make()
    parts = (made,) if isinstance(made, xr.Dataset) else made
    files = tuple(_write(work / "data", data) for data in parts)
    if not figure.startswith("bifurcations"):
        data = tuple(figures.open_data(work / "data" / name) for name in files)
        figures.save_both(figures.redraw(data), work / "figures" / figure)
    return files


def _write(folder: Path, data: xr.Dataset) -> str:
    figure = str(data.attrs["figure"])
    name = figure if figure != "none" else f"bifurcations-{data.attrs['set']}"
    numeric = [key for key, variable in data.data_vars.items() if variable.dtype.kind in "fi"]
    packed = {key: {"zlib": True} for key in numeric}
    content = bytes(data.to_netcdf(engine="h5netcdf", encoding=packed))
    write_files({folder / f"{name}.nc": content})
    return f"{name}.nc"


def _makers(found: Findings) -> dict[str, Maker]:
    """Map each figure to what makes its data, those that take long first."""
    sets, plan, panel = found.sets, found.plan, datasets.panel_data
    example = sets[EXAMPLE_SET]
    at = [(sets[m.point.set], m) for m in found.circles]
    makers: dict[str, Maker] = {"circles": partial(_circles, plan, at)}
    for i, each in enumerate(found.unfolded, 1):
        makers[f"unfolding-{each.set}-{i}"] = partial(unfolding_data, each, i, sets[each.set], plan)
    for figure in plan.figures:
        rows = [p for p in panels() if p.figure == figure]
        if rows[0].shows == "multipliers":
            makers[f"figure-{figure}"] = partial(_multipliers, plan, [sets[p.set] for p in rows])
        else:
            shown = [found.panels[p.name] for p in rows]
            name = f"figure-{figure}"
            makers[name] = partial(panel, name, sets[rows[0].set], plan, shown)
    makers["multipliers-A"] = partial(datasets.multiplier_data, example, plan)
    for name, one in found.resonances.items():
        makers[f"strong-{name}"] = partial(resonance_data, one, sets[one.set], plan, claims())
    for name, one_family in found.families.items():
        shown_there = {n: found.panels[n] for n in one_family.at_panels}
        makers[f"families-{name}"] = partial(family_data, one_family, sets[name], shown_there, plan)
    for name in sets:
        makers[f"diagram-{name}"] = partial(
            datasets.diagram_data, sets[name], plan, found.followed[name]
        )
    if found.spectra:
        makers["spectra"] = partial(tuple, found.spectra)
    for figure, data in found.ensembles.items():
        makers[figure] = partial(tuple, (data,))
    for figure, impacts in (
        ("mechanism", 1),
        ("history", EXAMPLE_IMPACTS),
        ("portrait", PORTRAIT_IMPACTS),
    ):
        makers[figure] = partial(_example, figure, example, plan, impacts)
    if EXAMPLE_PANEL in found.panels:
        makers["section"] = partial(panel, "section", example, plan, (found.panels[EXAMPLE_PANEL],))
    for name in sets:
        makers[f"bifurcations-{name}"] = partial(
            datasets.bifurcation_data, sets[name], plan, found.bifurcations[name]
        )
    return makers


def _circles(plan: Plan, at: Sequence[tuple[ParameterSet, Measured]]) -> tuple[xr.Dataset, ...]:
    return tuple(datasets.circle_data(chosen, plan, one) for chosen, one in at)


def _multipliers(plan: Plan, chosen: Sequence[ParameterSet]) -> tuple[xr.Dataset, ...]:
    return tuple(datasets.multiplier_data(one, plan) for one in chosen)


def _example(figure: str, chosen: ParameterSet, plan: Plan, impacts: int) -> xr.Dataset:
    """Simulate the stable orbit of set A, disturbed so that it settles visibly."""
    orbit = branch_orbit(chosen, EXAMPLE_OMEGA)
    assert orbit is not None
    start = orbit.state.perturbed(PORTRAIT_PUSH) if figure == "portrait" else orbit.state
    run = simulate(damper_of(chosen, EXAMPLE_OMEGA), start, impacts=impacts)
    return datasets.run_data(figure, chosen, plan, run, impacts)
