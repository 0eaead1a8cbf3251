"""Exceptions of the package.

A misuse raises an exception; a numerical outcome (chatter, sticking, no impact) is a status.
"""

from __future__ import annotations

import contextlib
import sys
import warnings
from pathlib import Path
from traceback import walk_stack


class VibroImpactError(Exception):
    """Base of every exception that this package raises on purpose."""


class InvalidParameterError(VibroImpactError, ValueError):
    """A value, shape or combination outside its allowed range.

    The message reads ``name = value: what is allowed. What to do.``
    """


class KeywordError(InvalidParameterError, TypeError):
    """A keyword that a class does not take; a TypeError, too, as Python's own is."""


class ResonanceError(InvalidParameterError):
    """Forcing at or too near an undamped resonance; in an ensemble, an outcome."""


class BackendUnavailableError(VibroImpactError, ImportError):
    """What was asked for needs a package that is not there.

    The message names the extra to install.
    """


class ClusterLostError(VibroImpactError):
    """The scheduler of a cluster or its client is gone, or they gave the tasks up.

    What was done is kept in the store, if there is one.
    """


class StoreError(VibroImpactError, OSError):
    """A store of results cannot be written; what it holds already is kept."""


def warn(text: str) -> None:
    """Warn of the line that called this package."""
    ours = (
        str(Path(__file__).parents[1]),
        contextlib.__file__,
    )  # its decorators call what they wrap
    frames = enumerate(walk_stack(sys._getframe()))
    last = max(level for level, (frame, _) in frames if frame.f_code.co_filename.startswith(ours))
    warnings.warn(text, stacklevel=last + 2)
