"""Command vibroimpact simulate: every impact of a motion."""

from __future__ import annotations

import argparse
from pathlib import Path

from matplotlib.axes import Axes

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.cli import common
from vibroimpact.cli.output import write
from vibroimpact.machines.toml_file import HybridCase
from vibroimpact.model.system import mechanism_of
from vibroimpact.plotting import plot_history, plot_hybrid_run
from vibroimpact.simulation.hybrid_run import simulate_hybrid
from vibroimpact.simulation.simulate import Run, RunEnd, simulate

EXAMPLE = (
    "  vibroimpact simulate impact-damper/A --omega 1.0 --perturb 1e-3 --impacts 4000 "
    "--out run.nc --out history.svg"
)
LENGTH = ("impacts", "t_max")
PERIODS = 6  # forcing periods in the picture if no window is given
TURN = 2.0 * 3.141592653589793


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_system(parser)
    common.add_start(parser)
    common.add_arguments_of(parser, simulate, LENGTH)
    parser.add_argument(
        "--window", type=float, nargs=2, metavar=("T0", "T1"),
        help=f"time shown in the picture (default: the last {PERIODS} forcing periods)",
    )  # fmt: skip
    common.add_out(parser)


def run(arguments: argparse.Namespace) -> str:
    """Simulate, write, and count the events."""
    targets = common.targets_of(arguments)
    case = common.any_case_of(arguments)
    if isinstance(case, HybridCase):
        return _hybrid(arguments, case, targets)
    state = common.start_of(arguments, case)
    motion = simulate(case.system, state, **common.given(arguments, LENGTH))
    if motion.end not in (RunEnd.IMPACTS, RunEnd.HORIZON):
        way = " Give --t-max." if motion.end is RunEnd.EVENTS else ""
        raise common.Failure(f"after {motion.impacts.sum()} impacts: {motion.end.sentence}.{way}")
    write(targets, data=motion, picture=lambda: _picture(motion, arguments.window))
    return f"{case.system}\n{state}\n{motion}\nends in {motion.last}{common.listed(targets)}"


def _hybrid(arguments: argparse.Namespace, case: HybridCase, targets: list[Path]) -> str:
    """The same of a system given as modes and guards."""
    start, impacts = case.start, arguments.impacts
    if start is None:
        raise InvalidParameterError(
            f"config = {arguments.config}: a [hybrid] starts in a mode. Give [start] with mode and state."
        )
    if impacts is not None:
        raise InvalidParameterError(
            f"--impacts {impacts}: a [hybrid] has transitions and no impacts. Give --t-max."
        )
    for name in (*common.START, "window"):
        if getattr(arguments, name, None) is not None:
            raise InvalidParameterError(
                f"{common.option(name)}: a [hybrid] starts as [start] says, and is drawn as a whole. "
                "Leave it out."
            )
    motion = simulate_hybrid(
        case.system, start.mode, start.state, phase=start.phase,
        **common.given(arguments, ("t_max",)),
    )  # fmt: skip
    if motion.end not in (RunEnd.HORIZON, RunEnd.EVENTS):
        raise common.Failure(f"after {len(motion)} events: {motion.end.sentence}.")
    write(targets, data=motion, picture=lambda: plot_hybrid_run(motion))
    return f"{motion}\nends in {motion.modes[-1]}: {motion.after[-1]}{common.listed(targets)}"


def _picture(motion: Run, window: list[float] | None) -> Axes:
    if window:
        return plot_history(motion, *window)
    omega, end = mechanism_of(motion.system).omega, float(motion.time[-1])
    return plot_history(motion, max(0.0, end - PERIODS * TURN / omega) if omega else 0.0)
