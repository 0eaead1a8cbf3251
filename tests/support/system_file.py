"""A compiled system and its starts as text, for the C++ programs of tests and benchmarks.

``tests/cpp/system_file.hpp`` reads it. Hexadecimal floats: no digit is lost.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibroimpact.compile.hybrid import Hybrid
from vibroimpact.model.system import mechanism_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import vibroimpact as vi
    from vibroimpact.compile.hybrid import Mode


def system_text(system: Any, states: Sequence[vi.State]) -> str:
    """The system with every mode it begins with, and the states."""
    hybrid = Hybrid(mechanism_of(system))
    out = [str(hybrid.size), str(hybrid.mechanism.degrees), str(int(hybrid.mixed))]
    out += [*_words(hybrid.omegas), *_words(hybrid.kappas), float(hybrid.step).hex()]
    laws = hybrid.laws()
    out.append(str(len(laws)))
    for impulse, mobility, shift, lower, upper in laws:
        out += [*_words(impulse), *_words(mobility), *_words(shift), lower.hex(), upper.hex()]
    modes = [hybrid.mode(code) for code in hybrid.codes]
    out.append(str(len(modes)))
    for mode in modes:
        out += _mode_words(mode)
    out.append(str(len(states)))
    for state in states:
        out += [*_words(state.position), *_words(state.velocity), *_words([state.phase])]
    return "\n".join(out)


def _mode_words(mode: Mode) -> list[str]:
    at = mode.coordinates
    out = [str(mode.code)]
    for key in ("k", "c", "a", "b", "constant"):
        out += _words(np.array(at.flow.get(key, []), dtype=float).ravel())
    for row, gain, lower, upper, side in mode.guards:
        out += [*_words(row), gain.hex(), lower.hex(), upper.hex(), str(side)]
    for part in (at.to_x, at.to_v, at.offset, at.from_x, at.from_v, at.particular):
        out += _words(np.ravel(part))
    return out


def _words(values: Iterable[float]) -> list[str]:
    """Their number, and the numbers."""
    flat = [float(x) for x in values]
    return [str(len(flat)), *(x.hex() for x in flat)]
