"""What systems have that are described by numbers: a copy with other values, and a file."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any, Self, cast

from vibroimpact.results.result import Shown

if TYPE_CHECKING:
    from vibroimpact.model.state import State


class Described(Shown):
    """Base of systems that are described by numbers."""

    __slots__ = ()

    def replace(self, changes: Mapping[str, Any] | None = None, **named: Any) -> Self:
        """Return the system with other values: ``hammer.replace(omega=66.0)``.

        Parameters
        ----------
        changes, **named
            Values by parameter; of a mechanism by path, ``{"elements[0].upper": 0.003}``, or by field.

        Raises
        ------
        InvalidParameterError
            No such parameter, or a value out of range.
        """
        parameters = import_module("vibroimpact.model.parameters")
        return cast(Self, parameters.replaced(self, {**(changes or {}), **named}))

    def to_toml(self, start: State | None = None) -> str:
        """Return the text of a file for :func:`~vibroimpact.load_machine` and ``--config``.

        Parameters
        ----------
        start
            A start that goes with it, for :func:`~vibroimpact.load_start`.

        Notes
        -----
        Of a system that is code the file has its mechanism.
        """
        files = import_module("vibroimpact.machines.toml_text")  # of a room above
        return cast(str, files.toml_of(self, start))
