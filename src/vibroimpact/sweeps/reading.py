"""Check of datasets of sweeps that come from files: what their variables and attributes may hold.

Method      the observers that a dataset names say which variables they return, of which type and in which range; codes
            are among those that its attributes explain. A variable that was given another meaning, another
            ``long_name``, is the user's own, and is left alone
Fails       InvalidParameterError that names the variable
"""

from __future__ import annotations

import numpy as np

from vibroimpact._core.checks import check_count, nonnegative, positive
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.texts import json_of
from vibroimpact.machines.json_text import system_of
from vibroimpact.model.system import mechanism_of
from vibroimpact.sweeps.observers.observer import Variable
from vibroimpact.sweeps.observers.selection import described_observers, variables_of
from vibroimpact.sweeps.specification import SPECIFICATION_ATTRIBUTE

ADVICE = "Compute it again, or take a whole copy."


def check_dataset(data: xr.Dataset) -> None:
    """Refuse a dataset of a sweep with values that no sweep returns; other datasets are taken.

    Raises
    ------
    InvalidParameterError
        The message names the variable or the attribute.
    """
    if SPECIFICATION_ATTRIBUTE not in data.attrs:
        return
    try:
        known = _variables(data)
    except InvalidParameterError:
        raise
    except (LookupError, ValueError, TypeError, AttributeError) as error:
        raise InvalidParameterError(
            f"data: its attributes are damaged ({error!r}). {ADVICE}"
        ) from error
    for name, found in data.variables.items():
        wanted = known.get(str(name))
        if wanted and wanted.attrs["long_name"] != found.attrs.get("long_name"):
            wanted = None
        if wanted and not wanted.admits(found.values):
            least, most = wanted.within
            raise InvalidParameterError(
                f"data: {name} holds what no sweep returns: numbers of type {wanted.dtype} from {least:g} to "
                f"{most:g}, or NaN, are expected. {ADVICE}"
            )
        codes = (wanted or found).attrs.get("flag_values")
        if codes is not None and not np.isin(found.values, codes).all():
            raise InvalidParameterError(
                f"data: {name} holds a code that means nothing: {np.ravel(codes).tolist()} are known. {ADVICE}"
            )


def _variables(data: xr.Dataset) -> dict[str, Variable]:
    """Variables that the observers of a dataset return."""
    attrs = data.attrs
    nonnegative("settle_periods", attrs["settle_periods"])
    positive("periods", attrs["periods"])
    check_count("most_impacts", int(attrs["most_impacts"]), 1)
    system = system_of(attrs["mechanism"])
    if system is None:
        raise ValueError("no mechanism")
    observers = described_observers(json_of("observe", attrs["observe"]))
    return variables_of(observers, mechanism_of(system))
