"""Files of a command: data in netCDF or CSV, pictures, pages of HTML; all of them or none."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib.pyplot as plt
from matplotlib.axes import Axes

from vibroimpact._core.files import replacing
from vibroimpact.plotting import save
from vibroimpact.plotting.report import PAGES
from vibroimpact.plotting.style import PICTURES
from vibroimpact.results.files import write as write_data

Picture = Callable[[], Axes]


class Done(NamedTuple):
    """Text that a command prints, and results that its files hold."""

    said: Sequence[object]  # results and lines, which are printed one below the other
    data: Any = ()  # a result, or several, which go to numbered files, name-1.nc, name-2.nc, ...
    # make a picture, and a report in HTML; called only where a file wants them
    picture: Picture | None = None
    page: Callable[[], str] | None = None


def write(paths: Sequence[Path], done: Done) -> list[Path]:
    """Write files by their suffixes, all of them or none, and return their names."""
    files = [pair for path in paths for pair in _files(path, done)]
    plt.switch_backend("agg")  # a file needs no window and no display
    with ExitStack() as stack:
        for path, put in files:
            put(stack.enter_context(replacing(path)))
    return [path for path, _ in files]


def _files(path: Path, done: Done) -> Iterator[tuple[Path, Callable[[Path], object]]]:
    """Functions that write the files of one name."""
    suffix = path.suffix.lower()
    if suffix in PICTURES and (draw := done.picture):
        yield path, lambda to: _draw(draw, to)
    elif suffix in PAGES and (page := done.page):
        yield path, lambda to: to.write_text(page(), encoding="utf-8")
    elif isinstance(data := done.data, list | tuple):
        for i, one in enumerate(data, 1):
            numbered = path.with_stem(f"{path.stem}-{i}")
            yield numbered, lambda to, one=one: write_data(one, to)  # type: ignore[misc]
    else:
        yield path, lambda to: write_data(data, to)


def _draw(picture: Picture, path: Path) -> None:
    with _drawn(picture) as ax:
        save(ax, path)


def rehearse_picture(paths: Sequence[Path], picture: Picture) -> None:
    """Make a picture if a file wants one, and drop it: an error comes before the long work."""
    if any(path.suffix.lower() in PICTURES for path in paths):
        plt.switch_backend("agg")
        with _drawn(picture):
            pass


@contextmanager
def _drawn(picture: Picture) -> Iterator[Axes]:
    ax = picture()
    try:
        yield ax
    finally:
        plt.close(ax.get_figure(root=True))
