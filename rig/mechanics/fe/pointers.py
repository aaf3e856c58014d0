"""Arrays as the compiled kernels take them: the address of their first number, checked for type.

The array must outlive every use of its address.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.fe._native import ffi


def reals(array: NDArray[np.float64]) -> Any:
    """As `double *`."""
    return _address(array, np.dtype(np.float64), "double *")


def ints(array: NDArray[np.int32]) -> Any:
    """As `int32_t *`."""
    return _address(array, np.dtype(np.int32), "int32_t *")


def longs(array: NDArray[np.int64]) -> Any:
    """As `int64_t *`."""
    return _address(array, np.dtype(np.int64), "int64_t *")


def flags(array: NDArray[np.uint8]) -> Any:
    """As `uint8_t *`."""
    return _address(array, np.dtype(np.uint8), "uint8_t *")


def _address(array: NDArray[Any], kind: np.dtype[Any], pointer: str) -> Any:
    if array.dtype != kind:
        raise TypeError(f"a kernel takes numbers of type {kind}, not {array.dtype}")
    return ffi.cast(pointer, array.ctypes.data)
