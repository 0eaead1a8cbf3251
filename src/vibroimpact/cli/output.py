"""What a command writes: data to netCDF or CSV, pictures by matplotlib, pages of HTML, all files or none."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.axes import Axes

from vibroimpact._core.files import replacing
from vibroimpact.plotting import save
from vibroimpact.plotting.report import PAGES
from vibroimpact.plotting.style import PICTURES
from vibroimpact.results.files import SUFFIXES as DATA
from vibroimpact.results.files import write as write_data


def write(
    paths: list[Path], *, data: Any, picture: Callable[[], Axes],
    page: Callable[[], str] = str,
) -> None:  # fmt: skip
    """Write files by their suffixes: all of them, or none.

    Parameters
    ----------
    paths
        Files that :func:`check_target` has passed.
    data
        The result for data files.
    picture, page
        Make what is written to pictures and to HTML; called only where a file wants it.
    """
    _write([(path, data) for path in paths], picture, page)


def write_each(
    paths: list[Path], *, data: Sequence[Any], picture: Callable[[], Axes]
) -> list[Path]:
    """Write several results to numbered files, name-1.nc, name-2.nc, ..., and pictures: all, or none.

    Parameters
    ----------
    paths
        Files that :func:`check_target` has passed; those of data without a number.
    data
        The results.
    picture
        Makes the picture; called only where a file wants it.

    Returns
    -------
    list of Path
        The files written.
    """
    files = [pair for path in paths for pair in _numbered(path, data)]
    _write(files, picture)
    return [path for path, _ in files]


def _numbered(path: Path, data: Sequence[Any]) -> list[tuple[Path, Any]]:
    if path.suffix.lower() not in DATA:
        return [(path, data[0])]  # a picture
    return [(path.with_stem(f"{path.stem}-{i}"), one) for i, one in enumerate(data, 1)]


def _write(
    files: Sequence[tuple[Path, Any]], picture: Callable[[], Axes],
    page: Callable[[], str] = str,
) -> None:  # fmt: skip
    with ExitStack() as stack:
        for path, data in files:
            temporary = stack.enter_context(replacing(path))
            if path.suffix.lower() in DATA:
                write_data(data, temporary)
            elif path.suffix.lower() in PAGES:
                plt.switch_backend("agg")
                temporary.write_text(page(), encoding="utf-8")
            else:
                with _drawn(picture) as ax:
                    save(ax, temporary)


def rehearse_picture(paths: list[Path], picture: Callable[[], Axes]) -> None:
    """Make a picture if a file wants one, and drop it: an error comes before the long work."""
    if any(path.suffix.lower() in PICTURES for path in paths):
        with _drawn(picture):
            pass


@contextmanager
def _drawn(picture: Callable[[], Axes]) -> Iterator[Axes]:
    plt.switch_backend("agg")  # a file needs no window and no display
    ax = picture()
    try:
        yield ax
    finally:
        plt.close(ax.get_figure(root=True))
