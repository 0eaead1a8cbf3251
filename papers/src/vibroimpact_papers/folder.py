"""Output folders that are whole or absent.

Everything is written into a hidden sibling, which takes the name of the folder at the end. An
interruption removes the sibling and leaves the earlier contents.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vibroimpact._core.errors import InvalidParameterError

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
    refuse_foreign(out)
    work = _sibling(out)
    try:
        yield work
        (work / MARK).write_text("made by vibroimpact; replaced whole by the next run\n")
        _replace(out, work)
    finally:
        shutil.rmtree(work, ignore_errors=True)


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


def _sibling(out: Path) -> Path:
    work = out.with_name(f".{out.name}-{os.getpid()}")
    try:
        work.mkdir()
    except OSError as error:
        raise _unwritable(out, error) from error
    return work


def _unwritable(out: Path, error: OSError) -> InvalidParameterError:
    return InvalidParameterError(
        f"out = {out}: cannot be written ({error.strerror}); its parent must be a folder that "
        "you may write. Name another folder."
    )


def _replace(out: Path, work: Path) -> None:
    """Put ``work`` in the place of ``out``; if that fails, ``out`` stays as it was."""
    if not out.exists():
        work.rename(out)
        return
    old = work.with_name(work.name + "-old")
    try:
        out.rename(old)
        try:
            work.rename(out)
        except BaseException:
            old.rename(out)
            raise
    except OSError as error:
        raise _unwritable(out, error) from error
    shutil.rmtree(old, ignore_errors=True)
