"""Names for the arrays that all rooms pass around."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]
Codes = NDArray[np.int32]  #: what the kernel writes of events: status, contact, side, mode
Rows = NDArray[np.intp]  #: indices into arrays
Arrays = dict[str, NDArray[Any]]  #: variables by name
