"""Exceptions of the package.

A misuse raises an exception; a numerical outcome (chatter, sticking, no impact) is a status.
"""

from __future__ import annotations

import contextlib
import sys
import warnings
from pathlib import Path
from traceback import walk_stack


def printable(text: str) -> str:
    """Text with escapes for control characters, which would reach a terminal, and for what has no encoding."""
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() or c in "\n\t" else c.encode("unicode_escape").decode() for c in text
    )


class VibroImpactError(Exception):
    """Base of every exception that this package raises on purpose."""

    def __str__(self) -> str:
        return printable(super().__str__())


class InvalidParameterError(VibroImpactError, ValueError):
    """A value, shape or combination outside its allowed range.

    The message reads ``name = value: what is allowed. What to do.``
    """


class KeywordError(InvalidParameterError, TypeError):
    """A keyword that a class does not take; a TypeError, too, as Python's own is."""


class ResonanceError(InvalidParameterError):
    """Forcing at or too near a resonance for its response to be split off the motion."""


class BackendUnavailableError(VibroImpactError, ImportError):
    """An optional package that the requested computation needs is not installed.

    The message names the extra to install.
    """


class ClusterLostError(VibroImpactError):
    """The connection to a cluster's scheduler was lost, or its tasks were cancelled.

    Finished work is kept in the store, if there is one.
    """


class StoreError(VibroImpactError, OSError):
    """A store of results cannot be written; its present contents are kept."""


def warn(text: str) -> None:
    """Warn, with the line that called this package as the place."""
    ours = (
        str(Path(__file__).parents[1]),
        contextlib.__file__,
    )  # its decorators call what they wrap
    frames = enumerate(walk_stack(sys._getframe()))
    last = max(level for level, (frame, _) in frames if frame.f_code.co_filename.startswith(ours))
    warnings.warn(text, stacklevel=last + 2)
