"""Files of a command: data in netCDF, CSV or XLSX, pictures, pages of HTML; all of them or none."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from vibroimpact._core.files import write_files
from vibroimpact.results.files import ANIMATIONS, PAGES, PICTURES, content_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Picture = Callable[[], "Axes"]


class Done(NamedTuple):
    """Text that a command prints, and results that its files hold."""

    said: Sequence[object]  # results and lines, which are printed one below the other
    data: Any = ()  # a result, or several, which go to numbered files, name-1.nc, name-2.nc, ...
    # make a picture, and a report in HTML; called only where a file wants them
    picture: Picture | None = None
    page: Callable[[], str] | None = None
    animation: Callable[[str], bytes] | None = None  # makes the content of a file with this suffix


def write(paths: Sequence[Path], done: Done, columns: int | None = None) -> list[Path]:
    """Write files by their suffixes, all of them or none, and return their names; pictures for print in columns."""
    contents = {path: content for one in paths for path, content in _files(one, done, columns)}
    write_files(contents, "out")
    return [*contents]


def _files(path: Path, done: Done, columns: int | None) -> Iterator[tuple[Path, bytes]]:
    """Files of one name, with their contents."""
    suffix = path.suffix.lower()
    if suffix in PICTURES and done.picture:
        from vibroimpact.plotting.style import content_of_picture, print_style

        printed = print_style(columns) if columns else nullcontext()
        with printed, _drawn(done.picture) as ax:
            yield path, content_of_picture(ax, suffix)
    elif suffix in ANIMATIONS and done.animation:
        yield path, done.animation(suffix)
    elif suffix in PAGES and done.page:
        yield path, done.page().encode()
    elif isinstance(data := done.data, list | tuple):
        for i, one in enumerate(data, 1):
            yield path.with_stem(f"{path.stem}-{i}"), content_of(one, suffix)
    else:
        yield path, content_of(data, suffix)


def wants(paths: Sequence[Path], suffixes: tuple[str, ...]) -> bool:
    """Whether a file has one of these suffixes."""
    return any(path.suffix.lower() in suffixes for path in paths)


def rehearse_picture(paths: Sequence[Path], picture: Picture) -> None:
    """Make a picture if a file wants one, and drop it: an error comes before the long work."""
    if wants(paths, PICTURES):
        with _drawn(picture):
            pass


@contextmanager
def _drawn(picture: Picture) -> Iterator[Axes]:
    """Axes of a picture, which is dropped afterwards; a file needs no window and no display."""
    import matplotlib.pyplot as plt

    plt.switch_backend("agg")
    ax = picture()
    try:
        yield ax
    finally:
        plt.close(ax.get_figure(root=True))
