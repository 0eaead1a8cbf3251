"""What a notebook shows of a machine or a result: its sentence, a small table, a small picture.

Nothing is computed: the sentence is the ``repr``, the table has the first and last rows of what the result holds, the
picture is ``plot()``. Of a design they are its parameters and its search, as its response is computed when it is drawn.
"""

from __future__ import annotations

import base64
from html import escape
from typing import TYPE_CHECKING, Any, cast

from vibroimpact._core.errors import VibroImpactError
from vibroimpact._core.lazy import pd
from vibroimpact.design.optimise import Design
from vibroimpact.machines.machine import Machine, parameters_of
from vibroimpact.machines.units import units_of
from vibroimpact.plotting.mechanism import plot_mechanism
from vibroimpact.plotting.report import picture_of
from vibroimpact.results.result import Result, titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROWS, COLUMNS = 8, 8  # of a table, at most
WIDTH = 440  # pixels of a picture


def html_of(shown: Any) -> str:
    """A machine or a result as a cell of a notebook shows it, as HTML."""
    title = _title(shown)
    parts = [
        f'<div style="white-space: pre-line">{title}</div>',
        _table(shown),
        _picture(shown, title),
    ]
    return "\n".join(part for part in parts if part)


def _title(shown: Any) -> str:
    """The class of a machine, whose numbers are in its table; what is said of another thing without computing."""
    if isinstance(shown, Machine):
        return type(shown).__name__
    return escape(repr(shown) if isinstance(shown, Result) else str(shown))


def _table(shown: Any) -> str:
    """Special points of a branch, rows of another result, parameters of a machine."""
    if isinstance(shown, Machine):
        table = _parameters(shown)
    elif isinstance(shown, Design):
        table = _best(shown)
    elif isinstance(shown, Result):
        data = shown.to_dataset()
        dim = "special" if data.sizes.get("special", 0) else ""
        if not data.sizes:
            return ""
        table = titled(shown.to_dataframe(dim))
    else:
        return ""
    shape = {"max_rows": ROWS, "max_cols": COLUMNS}
    return cast(str, table.to_html(**shape, index=False, float_format="%.6g"))


def _parameters(machine: Machine) -> pd.DataFrame:
    """Name and value of each parameter, with units where the machine is in SI."""
    names, units = parameters_of(type(machine)), units_of(machine)
    values = [getattr(machine, name) for name in names]
    if units.si:
        values = [
            units.of_parameter(name, value) if isinstance(value, float) else value
            for name, value in zip(names, values, strict=True)
        ]
    return pd.DataFrame({"parameter": [*names], "value": values})


def _best(design: Design) -> pd.DataFrame:
    """Name, value, unit of each parameter of a design, and the bound at which it is."""
    names, at = [*design.parameters], design.at_bounds
    columns: dict[str, list[Any]] = {"parameter": names}
    columns["value"] = [*design.parameters.values()]
    columns["unit"] = [design.units[name] for name in names]
    columns["at its bound"] = [at.get(name, "") for name in names]
    return pd.DataFrame({name: column for name, column in columns.items() if any(column)})


def _drawn(shown: Any) -> Axes:
    if isinstance(shown, Design):
        return shown.plot(what="search")
    return shown.plot() if isinstance(shown, Result) else plot_mechanism(shown)


def _picture(shown: Any, title: str) -> str:
    """The drawing of a machine, the plot of a result; nothing where there is nothing to draw."""
    try:
        ax = _drawn(shown)
    except VibroImpactError:
        return ""
    content = base64.b64encode(picture_of(ax, ".png")).decode("ascii")
    return f'<img alt="{title}" width="{WIDTH}" src="data:image/png;base64,{content}">'
