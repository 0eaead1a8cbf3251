"""Output folders that are whole or absent.

Everything is written into a hidden sibling, which takes the name of the folder at the end. An
interruption removes the sibling and leaves the earlier contents.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.files import draft_folder

MARK = ".vibroimpact"  # a file in every folder made here: such a folder may be replaced


@contextmanager
def whole_folder(out: Path) -> Iterator[Path]:
    """Yield an empty folder that becomes ``out`` if the block ends well.

    Parameters
    ----------
    out
        Must be absent, empty, or made by this function before.

    Raises
    ------
    InvalidParameterError
        ``out`` holds other files, is not a folder, or its parent cannot be written.
    """
    out = Path(out).absolute()
    _restore(out)
    refuse_foreign(out)
    with ExitStack() as drafts:
        try:
            work = drafts.enter_context(draft_folder(out))
        except OSError as error:
            raise _unwritable(out, error) from error
        yield work
        (work / MARK).write_text("made by vibroimpact; replaced whole by the next run\n")
        _replace(out, work)


def refuse_foreign(out: Path) -> None:
    """Refuse a path that is not a folder, or a folder with foreign files."""
    if out.exists() and not out.is_dir():
        raise InvalidParameterError(f"out = {out}: is not a folder. Name another.")
    try:
        foreign = out.exists() and any(out.iterdir()) and not (out / MARK).exists()
    except OSError as error:
        raise _unwritable(out, error) from error
    if foreign:
        raise InvalidParameterError(
            f"out = {out}: holds foreign files; must be absent, empty or an earlier "
            "output. Name another folder."
        )


def _unwritable(out: Path, error: OSError) -> InvalidParameterError:
    return InvalidParameterError(
        f"out = {out}: cannot be written ({error.strerror}); its parent must be a folder that "
        "you may write. Name another folder."
    )


def _replace(out: Path, work: Path) -> None:
    """Put ``work`` in the place of ``out``; if that fails, ``out`` stays as it was."""
    old = _old(out)
    try:
        if out.exists():
            out.rename(old)
        try:
            work.rename(out)
        except BaseException:
            if old.exists():
                old.rename(out)
            raise
    except OSError as error:
        raise _unwritable(out, error) from error
    shutil.rmtree(old, ignore_errors=True)


def _old(out: Path) -> Path:
    """Name of the earlier output while the new one takes its place."""
    return out.with_name(f".{out.name}-old")


def _restore(out: Path) -> None:
    """Give the earlier output its name again, if a process was killed while the new one took its place."""
    if _old(out).is_dir() and not out.exists():
        _old(out).rename(out)
