"""The kernels of a device as machine code: compiled at run time by NVRTC, and kept.

Method      kernels.cu and the installed headers are compiled for exactly the sizes of a batch, the
            observers that are wanted and the architecture of the device; fma is never contracted,
            so every operation rounds as it does on a processor
Assumes     the package cuda-core; a device is not needed to compile
Fails       a cache that cannot be written is left alone: the kernels are compiled anew
"""

from __future__ import annotations

import hashlib
import io
import os
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import vibroimpact
from vibroimpact._core.errors import BackendUnavailableError

SOURCE = Path(__file__).with_name("kernels.cu")
KERNELS = ("entry_sizes", "build", "run")


class Kernels(NamedTuple):
    """What is compiled: the macros of kernels.cu.

    Attributes
    ----------
    dimension, lines, contacts
        Sizes of the compiled systems.
    mixed
        Whether positions show q' of blocks, as 0 or 1.
    tangents
        Tangent vectors carried along; 0 for none.
    observers
        Mask of those that are wanted.
    """

    dimension: int
    lines: int
    contacts: int
    mixed: int
    tangents: int
    observers: int

    @property
    def macros(self) -> list[tuple[str, str]]:
        """Names and values."""
        return [(f"VI_{name.upper()}", str(value)) for name, value in self._asdict().items()]


def include_folder() -> Path:
    """Where the headers are: in the installed package, or beside the source of a checkout."""
    package = Path(vibroimpact.__file__).parent
    for folder in (package / "include", package.parents[1] / "include"):
        if (folder / "vibroimpact").is_dir():
            return folder
    raise BackendUnavailableError(
        f"backend = 'cuda': the headers of the kernel are missing from {package}. "
        "Install vibroimpact again."
    )


def cuda_core() -> Any:
    """The package cuda.core.

    Raises
    ------
    BackendUnavailableError
        It is not installed.
    """
    try:
        import cuda.core
    except ImportError:
        raise BackendUnavailableError(
            "backend = 'cuda': needs cuda-core, which is not installed. "
            "Run: pip install 'vibroimpact[cuda]'."
        ) from None
    return cuda.core


def compile_kernels(kernels: Kernels, arch: str) -> tuple[bytes, str]:
    """Compile for an architecture such as "sm_90": machine code, and what the assembler reports."""
    core, log = cuda_core(), io.StringIO()
    options = core.ProgramOptions(
        arch=arch, include_path=[str(include_folder())], define_macro=kernels.macros, **_OPTIONS
    )
    program = core.Program(SOURCE.read_text(), "c++", options)
    return bytes(program.compile("cubin", logs=log).code), log.getvalue()


_OPTIONS = {
    "std": "c++20",
    "fma": False,  # a*b + c is two roundings on every target, and fma(a, b, c) one
    "ftz": False,
    "prec_div": True,
    "prec_sqrt": True,
    "device_as_default_execution_space": True,  # for lambdas without a mark
    "ptxas_options": "-v",  # registers and spills go to the log
}


def kept_kernels(kernels: Kernels, arch: str) -> bytes:
    """Machine code from the cache, compiled where it is not there yet."""
    file = cache_folder() / f"{_key(kernels, arch)}.cubin"
    try:
        return file.read_bytes()
    except OSError:
        code, _ = compile_kernels(kernels, arch)
        _keep(file, code)
        return code


def cache_folder() -> Path:
    """Where compiled kernels are kept: ``$XDG_CACHE_HOME/vibroimpact``, or that of the home."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "vibroimpact"


def _keep(file: Path, code: bytes) -> None:
    """Write a file that is whole or not there; others may be writing the same."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=file.parent, delete=False) as part:
            part.write(code)
        Path(part.name).replace(file)
    except OSError:
        return


def _key(kernels: Kernels, arch: str) -> str:
    """Equal only where the machine code is."""
    text = repr((kernels, arch, sorted(_OPTIONS.items()), _compiler(), _sources()))
    return hashlib.sha256(text.encode()).hexdigest()


def _compiler() -> tuple[int, int]:
    """Version of NVRTC."""
    from cuda.bindings import nvrtc

    _, major, minor = nvrtc.nvrtcVersion()
    return int(major), int(minor)


@cache
def _sources() -> str:
    """Digest of the source and of every header."""
    digest = hashlib.sha256()
    for file in _files():
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


def _files() -> Iterator[Path]:
    yield SOURCE
    yield from sorted(include_folder().rglob("*.hpp"))
