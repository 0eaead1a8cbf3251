"""Checks of the values that users give, in the first lines of every public function.

An error message reads ``name = value: must be ... What to do.``; a long value is shortened.
"""

from __future__ import annotations

import contextlib
import functools
import inspect
import math
import os
import reprlib
import resource
from collections.abc import Callable, Collection, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.errors import InvalidParameterError, KeywordError
from vibroimpact._core.scalars import as_python, is_finite, is_infinite, is_number
from vibroimpact._core.words import OF_ARGUMENTS, meant

Named = TypeVar("Named", bound=Callable[..., Any])

LARGEST_COUNT = 2**50  # the kernel counts events, some four per impact, in doubles
LARGEST_SEED = 2**64 - 1
NARROWEST_RANGE_ULPS = 256.0  # a range of a parameter must hold some numbers
MOST_TEXT = 160  # a message shows so many characters of another program at most
MOST_SHOWN_ENTRIES = 6  # a message shows so many entries of an array at most


# ---- values in messages --------------------------------------------------------------------------


class _Shortened(reprlib.Repr):
    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxlong = 80
        self.maxother = 160
        self.maxlist = self.maxtuple = self.maxdict = self.maxset = MOST_SHOWN_ENTRIES
        self.maxlevel = 3

    def repr_ndarray(self, value: NDArray[Any], _level: int) -> str:
        return (
            repr(value.tolist())
            if value.size <= MOST_SHOWN_ENTRIES
            else f"array of shape {value.shape}"
        )

    def repr_function(self, value: Any, _level: int) -> str:
        return f"the function {value.__name__}"


def shown(value: object) -> str:
    """Text of a value for a message: one line, some hundred characters at most."""
    return " ".join(_SHORTENED.repr(as_python(value)).split())


def shortened(text: str) -> str:
    """Text of another program for a message: one line, some hundred characters at most."""
    line = " ".join(text.split())
    return line if len(line) <= MOST_TEXT else f"{line[:MOST_TEXT]}..."


_SHORTENED = _Shortened()


def refusal(name: str, value: object, allowed: str, advice: str = "") -> InvalidParameterError:
    """Error with argument, value, allowed range, and advice."""
    return InvalidParameterError(
        f"{name} = {shown(value)}: must be {allowed}.{advice and ' ' + advice}"
    )


# ---- numbers -------------------------------------------------------------------------------------


def real(name: str, value: Any, allowed: str = "a finite number", functions: str = "") -> float:
    """Return value as a float, or raise naming the parameter, with advice if it is a function.

    A jet or a column is a number too, and is returned as it is (scalars.py). Text, truth values,
    complex numbers and arrays are refused.
    """
    number = value if is_number(value) else _float(value)
    if not is_finite(number):
        raise refusal(name, value, allowed, functions if callable(value) else "")
    return cast(float, number)


def _float(value: Any) -> float:
    """A real number as a float; NaN for anything else."""
    if type(value) is float:
        return value
    if isinstance(value, str | bytes | bool | np.bool_ | complex | np.complexfloating):
        return math.nan
    if getattr(value, "ndim", 0):
        return math.nan
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan


def real_or_infinite(name: str, value: Any, allowed: str, functions: str = "") -> float:
    """Return a number that may be infinite, or raise naming the parameter."""
    number = value if is_number(value) else _float(value)
    return cast(float, number) if is_infinite(number) else real(name, value, allowed, functions)


def positive(name: str, value: Any, advice: str = "") -> float:
    """Return value as a float > 0, or raise naming the parameter."""
    number = real(name, value, "a finite number > 0")
    if number <= 0.0:
        raise refusal(name, value, "> 0", advice)
    return number


def nonnegative(name: str, value: Any, advice: str = "") -> float:
    """Return value as a float >= 0, or raise naming the parameter."""
    number = real(name, value, "a finite number >= 0")
    if number < 0.0:
        raise refusal(name, value, ">= 0", advice)
    return number


def fraction(name: str, value: Any) -> float:
    """Return a coefficient of restitution, or raise naming the parameter."""
    number = real(name, value, "in [0, 1]")
    if not 0.0 <= number <= 1.0:
        raise refusal(
            name, value, "in [0, 1] (0 plastic, 1 elastic)", "An impact cannot add energy."
        )
    return number


def share(name: str, value: Any) -> float:
    """Return value as a float in (0, 1), or raise naming the parameter."""
    number = real(name, value, "in (0, 1)")
    if not 0.0 < number < 1.0:
        raise refusal(name, value, "in (0, 1)")
    return number


def in_range(name: str, value: Any, least: float, most: float) -> float:
    """Return value as a float in [least, most], or raise naming the parameter."""
    number = real(name, value, f"in [{least:g}, {most:g}]")
    if not least <= number <= most:
        raise refusal(name, value, f"in [{least:g}, {most:g}]")
    return number


def check_count(name: str, value: object, least: int, most: int = LARGEST_COUNT) -> None:
    """Refuse a count that is not an integer, too small or too large."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise refusal(name, value, f"an integer >= {least}")
    if value > most:
        raise refusal(name, value, f"at most {most}")


def check_index(name: str, value: object, size: int) -> None:
    """Refuse a value that is not an index of a sequence; negative ones count from its end."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise refusal(name, value, "an integer")
    if not -size <= value < size:
        raise refusal(name, value, f"{-size} to {size - 1}")


def check_memory(name: str, value: int, size: int, advice: str) -> None:
    """Refuse a count of items of ``size`` bytes each that exceeds the memory that there is here."""
    if value * size > memory_here():
        raise InvalidParameterError(
            f"{name} = {shown(value)}: needs {value * size / 1e9:.3g} GB, more than the memory here. {advice}"
        )


def memory_here() -> int:
    """Bytes of memory that this process may have: of the machine, of its control group, of ulimit -v."""
    least = memory_of_machine()
    limit, pages = resource.getrlimit(resource.RLIMIT_AS)[0], Path("/proc/self/statm")
    if limit != resource.RLIM_INFINITY:
        taken = (
            int(pages.read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE") if pages.exists() else 0
        )
        least = min(least, max(limit - taken, 0))
    return least


@functools.cache
def memory_of_machine(root: Path = Path("/")) -> int:
    """Bytes of memory of this machine, or of the control group in which this process is, used or free.

    The files of the control groups are below ``root``.
    """
    least = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    for limit in _limits_of_groups(root):
        with contextlib.suppress(OSError, ValueError):  # none there, or "max"
            least = min(least, int(limit.read_text()))
    return least


def _limits_of_groups(root: Path) -> Iterator[Path]:
    """Files with the limits of the control groups in which this process is, of both kinds that Linux has.

    The limits of the groups around one hold, too. A container sees its own group as the outermost, whatever its name.
    """
    with contextlib.suppress(OSError, ValueError):
        for line in (root / "proc/self/cgroup").read_text().splitlines():
            _, kind, group = line.split(":", 2)
            if kind and "memory" not in kind.split(","):
                continue
            top = root / "sys/fs/cgroup" / ("memory" if kind else "")
            inside = Path(group.lstrip("/"))
            for one in (inside, *inside.parents):
                yield top / one / ("memory.limit_in_bytes" if kind else "memory.max")


def ends_of(name: str, value: Any) -> tuple[float, float]:
    """Return (low, high), finite numbers with low < high, or raise naming it."""
    several = isinstance(value, Sequence | np.ndarray) and not isinstance(value, str)
    pair = several and getattr(value, "ndim", 1) == 1 and len(value) == 2
    low, high = map(_float, value) if pair else (math.nan, math.nan)
    if not (math.isfinite(low) and math.isfinite(high)):
        raise refusal(name, value, "(low, high), two finite numbers with low < high")
    if not low < high:
        raise InvalidParameterError(f"{name} = ({low}, {high}): need low < high.")
    return low, high


def range_of(name: str, value: Any, parameter: str, start: float) -> tuple[float, float]:
    """Return (low, high) with the value of a parameter between, wider than rounding, or raise."""
    low, high = ends_of(name, value)
    if not low <= start <= high:
        raise InvalidParameterError(
            f"{name} = ({low}, {high}): must hold {parameter} = {start} of the orbit."
        )
    narrowest = NARROWEST_RANGE_ULPS * math.ulp(max(abs(low), abs(high)))
    if high - low < narrowest:
        raise InvalidParameterError(
            f"{name} = ({low}, {high}): are {high - low:.1e} apart; rounding of {parameter} "
            f"requires at least {narrowest:.1e}."
        )
    return low, high


# ---- arrays --------------------------------------------------------------------------------------


def vector(
    name: str, value: Any, size: int | None = None, functions: str = ""
) -> tuple[float, ...]:
    """Return value as a tuple of finite floats, or raise naming shape or entry."""
    array = numbers(name, value, "numbers", functions)
    if array.ndim != 1 or (size is not None and array.size != size):
        wanted = "(n,)" if size is None else f"({size},)"
        raise InvalidParameterError(f"{name} has shape {array.shape}; expected {wanted}.")
    return tuple(array.tolist())


def numbers(name: str, value: Any, kind: str = "numbers", functions: str = "") -> NDArray[Any]:
    """Return value as a new array of finite floats, or of jets or columns, or raise naming it."""
    advice = functions if callable(value) else ""
    try:
        array = np.array(value)
    except (TypeError, ValueError, LookupError):
        raise refusal(name, value, kind, advice) from None
    if array.dtype.kind == "O":
        flat = [x if is_number(x) else _float(x) for x in array.flat]
        if not all(map(is_finite, flat)):
            raise refusal(name, value, kind, advice)
        kept = object if any(map(is_number, flat)) else float
        return np.array(flat, dtype=kept).reshape(array.shape)
    if array.dtype.kind not in "iuf":
        raise refusal(name, value, kind, advice)
    array = array.astype(float)
    if not all(map(math.isfinite, array.ravel().tolist())):  # of few entries quicker than numpy
        place = np.argwhere(~np.isfinite(array))[0]
        index = str(place.tolist()) if array.ndim else ""
        raise InvalidParameterError(
            f"{name}{index} = {array[tuple(place)]}: every entry must be finite."
        )
    return array


# ---- everything else -----------------------------------------------------------------------------


def check_kind(
    name: str, value: object, kinds: type | tuple[type, ...], allowed: str, advice: str = ""
) -> None:
    """Refuse an object of another class."""
    if not isinstance(value, kinds):
        raise refusal(name, value, allowed, advice)


def check_flag(name: str, value: object) -> None:
    """Refuse a value that is neither True nor False."""
    check_kind(name, value, (bool, np.bool_), "True or False")


def is_function(value: object) -> bool:
    """Whether a value can be called, and is no class."""
    return callable(value) and not isinstance(value, type)


def check_progress(progress: object) -> None:
    """Refuse a ``progress`` that is no flag, no function, and not None, which is as False."""
    if not isinstance(progress, bool | None) and not is_function(progress):
        raise refusal("progress", progress, "True, a function, or False or None for none")


def check_choice(name: str, value: object, choices: Collection[str], advice: str = "") -> None:
    """Refuse a value that is not among the choices."""
    if isinstance(value, str) and value in choices:
        return
    if not choices:
        raise InvalidParameterError(
            f"{name} = {shown(value)}: there is none to name.{advice and ' ' + advice}"
        )
    near = meant(value, choices, OF_ARGUMENTS).strip() if isinstance(value, str) else ""
    raise refusal(name, value, f"one of {', '.join(choices)}", advice or near)


def check_stop_name(value: object) -> None:
    """Refuse a value that is not the name of a stop."""
    if not isinstance(value, str) or value not in ("A", "B"):
        raise refusal("stop", value, '"A" or "B"')


def path_of(name: str, value: object) -> Path:
    """Return a name of a file or a folder as a path, ``~`` replaced by a home, or raise naming the argument.

    A name that no file system could hold is refused, and one that may not be looked up; whether
    something of that name is there, and of which kind, is left to the caller.
    """
    allowed = "the name of a file or a folder"
    check_kind(name, value, (str, os.PathLike), allowed)
    text = os.fspath(cast(Any, value))
    if not isinstance(text, str) or not text:
        raise refusal(name, value, allowed, "Give a text that is not empty.")
    try:
        found = os.path.expanduser(text)
        os.stat(found)
    except (FileNotFoundError, NotADirectoryError):
        pass
    except ValueError:  # a null byte, half of a surrogate pair
        raise refusal(
            name, value, allowed, "It holds a character that no name of a file can hold; remove it."
        ) from None
    except OSError as error:  # too long, no permission, a loop of links
        raise refusal(name, value, allowed, f"{error.strerror}: name another.") from None
    if found == text and text.startswith("~"):
        head = text.partition("/")[0]
        raise refusal(
            name, value, allowed, f"{head} is no user's home; ./{head} is a name in this folder."
        )
    return Path(found)


def names_arguments(**advice: str) -> Callable[[Named], Named]:
    """Make a class or a function refuse an unknown keyword with a list of those that it takes.

    Parameters
    ----------
    **advice
        Advice for keywords that are often tried, by keyword.
    """

    def answering(made: Named) -> Named:
        is_class = isinstance(made, type)
        call: Any = vars(made)["__init__"] if is_class else made
        known = list(inspect.signature(call).parameters)[is_class:]
        names = frozenset(known)

        @functools.wraps(call)
        def checked(*args: Any, **given: Any) -> Any:
            if not names.issuperset(given):
                name = next(name for name in given if name not in names)
                raise unknown_keyword(made.__name__, name, known, advice.get(name, ""))
            return call(*args, **given)

        if not is_class:
            return cast(Named, checked)
        made.__init__ = checked  # type: ignore[method-assign]
        return made

    return answering


def unknown_keyword(owner: str, name: str, known: Sequence[str], advice: str = "") -> KeywordError:
    """Error for an unknown keyword, with the known ones and the nearest of them."""
    near = f" {advice}" if advice else meant(name, known, OF_ARGUMENTS)
    return KeywordError(f"{name}: is no argument of {owner}, which takes {', '.join(known)}.{near}")
