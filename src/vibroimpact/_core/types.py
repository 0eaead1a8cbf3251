"""Types of arrays that all subpackages share."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]
Codes = NDArray[np.int32]  #: codes of events from the kernel: status, contact, side, mode
Rows = NDArray[np.intp]  #: indices into arrays
Arrays = dict[str, NDArray[Any]]  #: variables by name
