"""Many machines of one kind as one system, numbered: they run as lanes of one sweep.

Method      A population is a system with one parameter, the number of a machine; each machine has its
            own values of the parameters that vary. A sweep over the numbers compiles all machines
            together (compile/many_systems.py), as a grid of parameters would be.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vibroimpact._core.columns import Column
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import with_parameters, with_values
from vibroimpact.model.system import System, mechanism_of

NUMBER = "machine"  # the parameter


@dataclass(frozen=True, eq=False)
class Population:
    """Machines that differ in some parameters."""

    system: System = field(repr=False)  # the machine without these values
    columns: dict[str, Floats] = field(repr=False)  # values by name of a parameter, each (k,)
    machine: Any = 0.0  # number of the present one, 0 to k - 1; or a column of numbers

    @property
    def count(self) -> int:
        """Number of machines."""
        return len(next(iter(self.columns.values())))

    @property
    def mechanism(self) -> Mechanism:
        """Mechanism of the present machine, or of a column of them."""
        if isinstance(self.machine, Column):
            rows = self.machine.values.astype(np.intp)
            return mechanism_of(
                with_parameters(self.system, {k: Column(v[rows]) for k, v in self.columns.items()})
            )
        values = self.values(int(self.machine))
        try:
            return mechanism_of(with_parameters(self.system, values))
        except InvalidParameterError as error:
            raise InvalidParameterError(with_values(str(error), values)) from error

    def values(self, number: int) -> dict[str, float]:
        """Values of the parameters of one machine."""
        return {name: float(column[number]) for name, column in self.columns.items()}
