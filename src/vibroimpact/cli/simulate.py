"""Command vibroimpact simulate: every impact of a motion."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.cli import common
from vibroimpact.cli.output import Done, wants
from vibroimpact.machines.toml_file import HybridCase
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.results.files import ANIMATIONS, PAGES
from vibroimpact.simulation.hybrid_run import simulate_hybrid
from vibroimpact.simulation.reach import reach_in_words
from vibroimpact.simulation.simulate import ENDS_QUIETLY, Run, RunEnd, simulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

EXAMPLE = (
    "  vibroimpact simulate impact-damper/A --omega 1.0 --perturb 1e-3 --impacts 4000 "
    "--out run.nc --out history.svg"
)
LENGTH = ("impacts", "t_max")
SHOWN_PERIODS = 6  # the picture shows so many forcing periods if no window is given
FRAMES_PER_SECOND = 20  # of an animation
TURN = 2.0 * 3.141592653589793


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_start(parser)
    parser.set_defaults(or_rest=True)
    common.add_arguments_of(parser, simulate, LENGTH)
    parser.add_argument(
        "--window", type=float, nargs=2, metavar=("T0", "T1"),
        help="time shown in the picture, in its units, which are seconds for a [physical] file "
        f"(default: the last {SHOWN_PERIODS} forcing periods)",
    )  # fmt: skip
    common.add_out(parser, pages=PAGES, animations=ANIMATIONS)


def run(arguments: argparse.Namespace) -> Done:
    """Simulate."""
    case = common.any_case_of(arguments)
    if isinstance(case, HybridCase):
        return _hybrid(arguments, case)
    state = common.start_of(arguments, case)
    if wants(arguments.out, PAGES):
        _check_page()
    motion = simulate(case.system, state, **common.given(arguments, LENGTH))
    if motion.end not in (RunEnd.IMPACTS, RunEnd.HORIZON):
        goes_on = (RunEnd.EVENTS, *ENDS_QUIETLY)
        way = " With --t-max it is written and drawn." if motion.end in goes_on else ""
        words = reach_in_words(motion) if motion.end in ENDS_QUIETLY else ""
        reach = f" {words}." if words else ""
        raise common.Failure(
            f"after {motion.impacts.sum()} impacts: {motion.end.sentence}.{reach}{way}"
        )
    rest = ["between the stops: no start is given, and no orbit is known"]
    return Done(
        [
            case.system,
            *rest * common.begins_at_rest(arguments, case),
            state,
            motion,
            f"ends in {motion.last}",
        ],
        motion,
        lambda: _picture(motion, arguments.window),
        page=lambda: _page(case.system, state),
        animation=lambda suffix: _animation(motion, arguments.window, suffix),
    )


def _hybrid(arguments: argparse.Namespace, case: HybridCase) -> Done:
    """Simulate a system given as modes and guards."""
    start = case.start
    if start is None:
        raise InvalidParameterError(
            f"config = {arguments.config}: a [hybrid] starts in a mode. Give [start] with mode and state."
        )
    for name in common.given(arguments, (*common.START, "window", "impacts")):
        raise InvalidParameterError(
            f"{common.option(name)}: a [hybrid] starts as [start] says, has transitions and no impacts, and "
            "is drawn as a whole. Leave it out, or give --t-max."
        )
    if wants(arguments.out, ANIMATIONS + PAGES):
        raise InvalidParameterError(
            "out: a [hybrid] has no masses and stops that could move. Give a picture, .nc or .csv."
        )
    motion = simulate_hybrid(
        case.system, start.mode, start.state, phase=start.phase,
        **common.given(arguments, ("t_max",)),
    )  # fmt: skip
    if motion.end not in (RunEnd.HORIZON, RunEnd.EVENTS):
        raise common.Failure(f"after {len(motion)} events: {motion.end.sentence}.")
    last = f"ends in {motion.modes[-1]}: {motion.after[-1]}"
    return Done([motion, last], motion, motion.plot)


def _check_page() -> None:
    """Refuse before the run where the explorer's page is not part of the installation."""
    from vibroimpact.explorer.page import check_built

    check_built()


def _page(system: System, start: State) -> str:
    """The explorer's page at the machine and start of a run."""
    from vibroimpact.explorer.page import page_with
    from vibroimpact.explorer.page_data import machine_data

    data = machine_data(system, start)
    return page_with({data["name"]: data}, data["name"])


def _picture(motion: Run, window: list[float] | None) -> Axes:
    return motion.plot(*(window or _last(motion)))


def _animation(motion: Run, window: list[float] | None, suffix: str) -> bytes:
    from vibroimpact.plotting.animation import content_of_animation

    moving = motion.animate(*(window or _last(motion)), frames_per_second=FRAMES_PER_SECOND)
    return content_of_animation(moving, suffix)


def _last(motion: Run) -> list[float]:
    """Beginning of what is shown by default, the last periods."""
    omega, end = mechanism_of(motion.system).omega, float(motion.time[-1])
    return [max(0.0, end - SHOWN_PERIODS * TURN / omega) if omega else 0.0]
