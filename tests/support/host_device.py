"""A machine for the kernels of a device: this processor, and the memory of this process."""

from __future__ import annotations

import ctypes
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from vibroimpact.sweeps.execution.cuda.program import SOURCE, Kernels, include_folder

SHIM = Path(__file__).resolve().parents[1] / "cpp" / "host_device.cpp"
FLAGS = ("-std=c++20", "-O1", "-ffp-contract=off", "-fno-math-errno", "-Wno-psabi", "-fPIC")


class HostDevice:
    """A ``Machine`` of sweeps/execution/cuda/batch.py; kernels are compiled into a folder."""

    def __init__(self, folder: Path, free: int = 2**30) -> None:
        self.folder, self._free = folder, free
        self.launched: list[tuple[str, int]] = []
        self.lent = 0
        self._lock = threading.Lock()

    def free(self) -> int:
        """Bytes that are said to be free."""
        return self._free

    @contextmanager
    def memory(self) -> Iterator[HostMemory]:
        """Memory for one piece of work."""
        memory = HostMemory(self)
        with self._lock:
            yield memory
        self.lent = max(self.lent, sum(array.nbytes for array in memory.arrays))

    def library(self, kernels: Kernels) -> ctypes.CDLL:
        """The kernels, compiled."""
        out = self.folder / ("kernels_" + "_".join(map(str, kernels)) + ".so")
        if not out.exists():
            macros = [f"-D{name}={value}" for name, value in kernels.macros]
            folders = [f"-I{include_folder()}", f"-I{SOURCE.parent}"]
            command = ["g++", *FLAGS, *macros, *folders, "-shared", str(SHIM), "-o", str(out)]
            subprocess.run(command, check=True)
        return ctypes.CDLL(str(out))


class HostMemory:
    """A ``Memory``: numpy arrays."""

    def __init__(self, device: HostDevice) -> None:
        self.device, self.arrays = device, list[Any]()

    def room(self, size: int) -> int:
        self.arrays.append(np.zeros(size, dtype=np.uint8))
        return int(self.arrays[-1].ctypes.data)

    def put(self, array: Any) -> int:
        self.arrays.append(np.array(array, order="C"))
        return int(self.arrays[-1].ctypes.data)

    def get(self, address: int, into: Any) -> None:
        assert into.flags.c_contiguous
        ctypes.memmove(into.ctypes.data, address, into.nbytes)

    def launch(self, kernels: Kernels, name: str, threads: int, argument: int) -> None:
        self.device.launched.append((name, threads))
        function = getattr(self.device.library(kernels), f"launch_{name}")
        function(ctypes.c_void_p(argument), ctypes.c_uint(threads))
