"""Exceptions of the package.

A misuse raises an exception; a numerical outcome (chatter, sticking, no impact) is a status.
"""

from __future__ import annotations


class VibroImpactError(Exception):
    """Base of every exception that this package raises on purpose."""


class InvalidParameterError(VibroImpactError, ValueError):
    """A value, shape or combination outside its allowed range.

    The message reads ``name = value: what is allowed. What to do.``
    """
