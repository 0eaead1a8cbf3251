"""Files written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vibroimpact._core.checks import unwritable


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary name in the same folder; the file written there becomes ``path`` at the end.

    After an error or an interruption ``path`` is as it was and the other name is gone.
    """
    temporary = path.with_name(f".{path.stem}-{os.getpid()}{path.suffix}")
    try:
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise unwritable("out", path, error.strerror or str(error)) from error
    finally:
        temporary.unlink(missing_ok=True)
