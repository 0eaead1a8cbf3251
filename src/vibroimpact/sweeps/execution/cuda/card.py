"""A CUDA device: its memory, and the launch of kernels.

Method      the driver's memory calls, and cuda.core to load and launch; one piece of work at a
            time, on the default stream, so that copies and kernels follow each other in order
Fails       BackendUnavailableError where there is no device, each reason with what to do;
            VibroImpactError where the device refuses work
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.errors import BackendUnavailableError, VibroImpactError
from vibroimpact.sweeps.execution.cuda.program import Kernels, cuda_core, kept_kernels

OLDEST_DRIVER = 13_000  # CUDA 13.0, that of the compiler: older drivers refuse its machine code
THREADS = 64  # per block: 255 registers each leave room for four blocks on a multiprocessor


class Card:
    """The first device that is visible, as a ``Machine`` of batch.py.

    Attributes
    ----------
    name, arch
        For people, and for the compiler, such as "sm_90".
    driver
        Newest version of CUDA that its driver knows, such as 13000.
    """

    def __init__(self, driver: Any, version: int) -> None:
        self._driver, self._core, self.driver = driver, cuda_core(), version
        self._device = self._core.Device(0)
        self._device.set_current()
        major, minor = self._device.compute_capability
        self.name, self.arch = str(self._device.name), f"sm_{major}{minor}"
        self._lock, self._loaded = threading.Lock(), dict[Kernels, Any]()

    def free(self) -> int:
        """Bytes of memory that are free."""
        with self._current():
            free, _ = self.checked(self._driver.cuMemGetInfo())
        return int(free)

    @contextmanager
    def memory(self) -> Iterator[CardMemory]:
        """Memory for one piece of work."""
        with self._current():
            memory = CardMemory(self, self._driver)
            try:
                yield memory
            finally:
                memory.release()

    @contextmanager
    def _current(self) -> Iterator[None]:
        """Let this thread alone use the device."""
        with self._lock:
            self._device.set_current()
            yield

    def launch(self, kernels: Kernels, name: str, threads: int, argument: int) -> None:
        """Run so many threads of a kernel and wait for them."""
        if kernels not in self._loaded:
            self._loaded[kernels] = self.load(kept_kernels(kernels, self.arch))
        self.start(self._loaded[kernels].get_kernel(name), threads, argument)

    def load(self, code: bytes) -> Any:
        """Load machine code; its kernels have names."""
        return self._core.ObjectCode.from_cubin(code)

    def start(self, kernel: Any, threads: int, argument: int) -> None:
        """Run so many threads of a loaded kernel and wait for them."""
        config = self._core.LaunchConfig(grid=-(-threads // THREADS), block=THREADS)
        self._core.launch(self._device.default_stream, config, kernel, argument)
        self.checked(self._driver.cuCtxSynchronize())

    def checked(self, answer: tuple[Any, ...]) -> tuple[Any, ...]:
        """Everything but the status of an answer of the driver."""
        status, *rest = answer
        if int(status) != 0:
            _, text = self._driver.cuGetErrorString(status)
            raise VibroImpactError(
                f"backend = 'cuda': {self.name} refuses: {_text(text)}. "
                "With backend='threads' the same call gives the same results."
            )
        return tuple(rest)


class CardMemory:
    """A ``Memory`` of batch.py."""

    def __init__(self, card: Card, driver: Any) -> None:
        self._card, self._driver, self._blocks = card, driver, list[Any]()

    def room(self, size: int) -> int:
        """Address of so many bytes, all zero."""
        if size == 0:
            return 0
        (block,) = self._card.checked(self._driver.cuMemAlloc(size))
        self._blocks.append(block)
        self._card.checked(self._driver.cuMemsetD8(block, 0, size))
        return int(block)

    def put(self, array: NDArray[Any]) -> int:
        """Address of a copy of an array."""
        whole = np.ascontiguousarray(array)
        address = self.room(whole.nbytes)
        if address:
            copied = self._driver.cuMemcpyHtoD(address, whole.ctypes.data, whole.nbytes)
            self._card.checked(copied)
        return address

    def get(self, address: int, into: NDArray[Any]) -> None:
        """Copy from an address into an array."""
        if into.nbytes:
            copied = self._driver.cuMemcpyDtoH(into.ctypes.data, address, into.nbytes)
            self._card.checked(copied)

    def launch(self, kernels: Kernels, name: str, threads: int, argument: int) -> None:
        """Run so many threads of a kernel with an address, and wait for them."""
        self._card.launch(kernels, name, threads, argument)

    def release(self) -> None:
        """Give everything back."""
        while self._blocks:
            self._driver.cuMemFree(self._blocks.pop())


@cache
def open_card() -> Card:
    """The card of this process.

    Raises
    ------
    BackendUnavailableError
        No cuda-core, no driver, a driver that is too old, no device.
    """
    cuda_core()
    driver = _driver()
    try:
        _, version = driver.cuDriverGetVersion()
        (status,) = driver.cuInit(0)
    except RuntimeError as error:  # the library is not there
        raise _unavailable(
            f"no NVIDIA driver was found ({error})",
            "Run on a machine with an NVIDIA card and its driver",
        ) from None
    if 0 < version < OLDEST_DRIVER:
        raise _unavailable(
            f"the driver supports CUDA {version // 1000}.{version % 1000 // 10}, "
            f"{OLDEST_DRIVER // 1000}.0 is needed",
            "Install a newer NVIDIA driver (580 or later)",
        )
    if int(status) != 0:
        _, text = driver.cuGetErrorString(status)
        visible = os.environ.get("CUDA_VISIBLE_DEVICES")
        shown = "" if visible is None else f" (CUDA_VISIBLE_DEVICES = {visible!r})"
        raise _unavailable(
            f"no device can be used: {_text(text)}{shown}", "See what nvidia-smi reports"
        )
    return Card(driver, int(version))


def _driver() -> Any:
    try:
        from cuda.bindings import driver
    except ImportError:
        raise BackendUnavailableError(
            "backend = 'cuda': needs cuda-bindings, which is not installed. "
            "Run: pip install 'vibroimpact[cuda]'."
        ) from None
    return driver


def _unavailable(reason: str, advice: str) -> BackendUnavailableError:
    return BackendUnavailableError(
        f"backend = 'cuda': {reason}. {advice}, or use backend='threads', which gives the same "
        "results."
    )


def _text(text: bytes | str | None) -> str:
    return text.decode() if isinstance(text, bytes) else str(text)
