"""Types of arrays that all subpackages share."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

# Words with a range, by which classes declare what their fields may hold (results/fields.py). Plain float, Floats and
# Complexes are finite there.
Count = int  #: at least 0
Sign = int  #: -1, 0 or 1
Index = int  #: at least 0, or -1 for none
Symbol = str  #: n-p-q of a motion, as symbol_word writes it; empty where there is none
Share = float  #: from 0 to 1
Positive = float  #: finite, above 0
Amount = float  #: finite, at least 0
AnyAmount = float  #: at least 0, infinite or NaN
AnyFloat = float  #: infinite and NaN, too
Bounds = tuple[float, float]  #: (low, high), finite, low < high
OneOrTwoBounds = Any  #: such a pair, or two of them, of two parameters

Floats = NDArray[np.float64]
Amounts = Floats  #: finite, at least 0
AnyAmounts = Floats  #: at least 0, infinite or NaN
Angles = Floats  #: from 0 to 2 pi
Rising = Floats  #: finite, never falling
Durations = Floats  #: finite, above 0 together
AnyFloats = Floats  #: infinite and NaN, too
Complexes = NDArray[np.complex128]
AnyComplexes = Complexes  #: infinite and NaN, too
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]
Counts = Integers  #: at least 0
Codes = NDArray[np.int32]  #: codes of events from the kernel: status, contact, side, mode
Indices = Codes  #: at least 0, or -1 for none
Sides = Codes  #: -1, 0 or 1
Rows = NDArray[np.intp]  #: indices into arrays
Arrays = dict[str, NDArray[Any]]  #: variables by name
