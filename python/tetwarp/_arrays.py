# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Arrays of others, on the host and on devices."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from . import _core
from .errors import InputError

#: Device types of DLPack that are CUDA's: its own memory, and managed memory.
CUDA_DEVICES = (2, 13)


class DeviceArray:
    """Values on a CUDA device that a simulation left there.

    `torch.from_dlpack`, `cupy.from_dlpack` and `jax.dlpack.from_dlpack` take it without a copy; `numpy.asarray` copies
    it to the host. It is complete: any stream may read it at once.

    Attributes
    ----------
    shape : tuple of int
    dtype : numpy.dtype
    """

    __slots__ = ("_core", "dtype", "shape")

    def __init__(self, core: _core.DisplacementCopy) -> None:
        self._core = core
        self.shape: tuple[int, ...] = tuple(core.shape)
        self.dtype: np.dtype[Any] = np.dtype(np.float32)

    def __dlpack__(self, **options: Any) -> Any:
        array: Any = self._core.exchanged()
        return array.__dlpack__(**options)

    def __dlpack_device__(self) -> tuple[int, int]:
        array: Any = self._core.exchanged()
        kind, number = array.__dlpack_device__()
        return int(kind), int(number)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray[Any, Any]:
        if copy is False:
            raise ValueError("the values lie on a device; NumPy needs a copy of them")
        values = np.asarray(self._core.on_host())
        return values if dtype is None else values.astype(dtype, copy=False)

    def __repr__(self) -> str:
        return f"<DeviceArray {self.shape}, {self.dtype}>"


def on_host(array: Any) -> Any:
    """The array; of a simulation's values on a device, a copy by NumPy."""
    return np.asarray(array) if isinstance(array, DeviceArray) else array


def is_on_device(array: Any) -> bool:
    """Whether an array lies in memory of a CUDA device."""
    if isinstance(array, np.ndarray):
        return False
    kind, _ = array.__dlpack_device__()
    return int(kind) in CUDA_DEVICES


def require_array(array: Any, name: str) -> Any:
    """The array as it is, or a view by NumPy of what offers the buffer protocol or DLPack on the host."""
    if isinstance(array, np.ndarray):
        if array.dtype.kind not in "iufcb":
            raise InputError(f"{name} holds {array.dtype}; expected numbers")
        if not array.dtype.isnative:
            raise InputError(
                f"{name} holds {array.dtype} in the byte order of other machines; pass the copy "
                'array.astype(array.dtype.newbyteorder("="))'
            )
        return array
    if hasattr(array, "__dlpack__") and hasattr(array, "__dlpack_device__"):
        return array if is_on_device(array) else _on_host(array, name)
    try:
        view = np.asarray(memoryview(array))
    except TypeError:
        raise TypeError(f"{name} is a {type(array).__name__}; expected an array") from None
    return view


def numbers(values: Any, dtype: Any, name: str) -> np.ndarray[Any, Any]:
    """A dense array of numbers: whole ones where whole ones are wanted; a copy only where it must be one."""
    kind = np.dtype(dtype)
    try:
        array = np.asarray(values)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} are no numbers") from None
    if array.size == 0:
        return np.empty(array.shape, kind)
    if array.dtype.kind not in ("iu" if kind.kind in "iu" else "iuf"):
        raise InputError(f"{name} hold {array.dtype}; expected {kind}")
    if kind.kind in "iu" and not np.iinfo(kind).min <= int(array.min()) <= int(array.max()) <= np.iinfo(kind).max:
        raise InputError(f"{name} hold a number that {kind} has not")
    with np.errstate(over="ignore", invalid="ignore"):  # what is too large becomes infinite, and is refused as that
        return np.ascontiguousarray(array, dtype=kind)


def _on_host(array: Any, name: str) -> np.ndarray[Any, Any]:
    if getattr(array, "requires_grad", False):
        raise InputError(f"{name} is a tensor that needs a gradient; pass array.detach()")
    try:
        return np.from_dlpack(array)
    except (BufferError, TypeError, RuntimeError) as error:
        raise InputError(f"{name} gives no array by DLPack: {error}") from None


def turned(array: Any, name: str) -> Any:
    """The array [k, j, i(, c)] that is the memory of an array [i, j, k] in Fortran order, or [c, i, j, k] of it."""
    axes = len(array.shape)
    if axes not in (3, 4):
        raise InputError(f"{name} has {axes} axes; expected [i, j, k] or [c, i, j, k]")
    return array.permute(*reversed(range(axes))) if hasattr(array, "permute") else array.transpose()


def require_dense(array: Any, name: str) -> None:
    """Refuses values with gaps between them, or in another order than [k, j, i] with i fastest."""
    if isinstance(array, np.ndarray):
        dense = array.flags.c_contiguous
        how = "numpy.ascontiguousarray(array)"
    elif hasattr(array, "is_contiguous"):  # PyTorch
        dense = array.is_contiguous()
        how = "array.contiguous()"
    elif hasattr(array, "flags"):  # CuPy
        dense = array.flags.c_contiguous
        how = "cupy.ascontiguousarray(array)"
    else:
        return  # JAX and a simulation have no other layout
    if not dense:
        raise InputError(
            f"{name} does not lie in memory as [k, j, i] with i fastest; pass the copy {how}, or "
            'order="ijk" for an array [i, j, k] in Fortran order'
        )


def require_result(array: Any, name: str) -> Any:
    """An array that takes a result. That it shares no memory with others, the binding looks at."""
    array = require_array(array, name)
    if isinstance(array, np.ndarray) and not array.flags.writeable:
        raise InputError(f"{name} is read-only; pass an array that may be written")
    return array


def library_of(array: Any) -> str:
    """Name of the library of an array on a device: "torch", "cupy" or "jax"."""
    return type(array).__module__.split(".")[0].replace("jaxlib", "jax")


def stream_of(array: Any, stream: Any) -> int:
    """The number of a CUDA stream: of what the caller gave, else the current one of the array's library."""
    if stream is not None:
        for name in ("cuda_stream", "ptr", "handle"):
            if hasattr(stream, name):
                return int(getattr(stream, name))
        try:
            return int(stream)
        except (TypeError, ValueError):
            raise TypeError(f"stream is a {type(stream).__name__}; expected a number or a stream of CUDA") from None
    library = library_of(array) if array is not None and is_on_device(array) else ""
    if library == "torch":
        return int(sys.modules["torch"].cuda.current_stream(array.device).cuda_stream)
    if library == "cupy":
        return int(sys.modules["cupy"].cuda.get_current_stream().ptr)
    return 0


def exchanged(array: Any, stream: int) -> Any:
    """What the binding takes: a NumPy array itself, of a device's array a capsule whose work is ordered on `stream`."""
    if isinstance(array, np.ndarray):
        return array
    # DLPack names the legacy default stream 1; 0 is not allowed, for it is ambiguous.
    return array.__dlpack__(stream=stream if stream else 1)


def empty_like(like: Any, shape: tuple[int, ...], dtype: Any) -> Any:
    """An array without values beside another: on its device and of its library, or NumPy's."""
    if isinstance(like, np.ndarray):
        return np.empty(shape, dtype)
    library = library_of(like)
    if library == "torch":
        torch = sys.modules["torch"]
        kind = dtype if isinstance(dtype, torch.dtype) else getattr(torch, np.dtype(dtype).name)
        return torch.empty(shape, dtype=kind, device=like.device)
    if library == "cupy":
        with like.device:
            return sys.modules["cupy"].empty(shape, dtype)
    if library == "jax":
        # JAX's arrays do not change; one of its own is filled by Tetwarp before anybody else sees it.
        jax = sys.modules["jax"]
        made = jax.device_put(jax.numpy.empty(shape, dtype), next(iter(like.devices())))
        return made.block_until_ready()
    raise InputError(f"arrays of {library} on a device are not known; pass out=")


def as_value(value: float, array: Any) -> float | int:
    """A value as the array's type holds it: rounded and saturated for whole numbers."""
    kind = np.dtype(str(array.dtype).rpartition(".")[2])
    if kind.kind not in "iu":
        return value
    limits = np.iinfo(kind)
    return int(min(max(round(value), limits.min), limits.max))


def smallest(array: Any) -> float:
    """The smallest value that is a number; 0 where there is none."""
    if isinstance(array, np.ndarray):
        if array.dtype.kind == "f":
            value = np.fmin.reduce(array, axis=None)
            return float(value) if value == value else 0.0
        return float(array.min())
    library = library_of(array)
    if library == "torch":
        torch = sys.modules["torch"]
        values = array[~torch.isnan(array)] if array.is_floating_point() else array
        return float(values.min()) if values.numel() else 0.0
    module = sys.modules["cupy"] if library == "cupy" else sys.modules["jax.numpy"]
    value = float(module.nanmin(array)) if array.dtype.kind == "f" else float(array.min())
    return value if value == value else 0.0
