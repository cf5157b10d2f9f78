# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Voxels with their place."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from . import _arrays, _calls, _core
from .errors import InputError
from .geometry import Geometry


class Volume:
    """An array of voxels and where they lie.

    Parameters
    ----------
    array : array
        Indexed [k, j, i], i fastest in memory, or [k, j, i, c] with c values a voxel: a NumPy array, or one on a CUDA
        device that speaks DLPack (CuPy, PyTorch, JAX). Nothing is copied.
    geometry : Geometry
        Its `shape` is that of the array.
    order : "kji" or "ijk"
        "ijk": the array is indexed [i, j, k] and lies in Fortran order, as nibabel gives it. It is the same memory and
        is turned without a copy.
    padding : (float, float), optional
        First and last of the values that are no data; they never mix with tissue.

    Raises
    ------
    InputError
        For another shape or layout. The message names the copy to make.

    Examples
    --------
    >>> volume = Volume(np.zeros((2, 3, 4), np.int16), Geometry((4, 3, 2)))
    >>> volume.array.shape
    (2, 3, 4)
    """

    __slots__ = ("array", "background", "derivation", "geometry", "notes", "padding", "series")

    def __init__(
        self,
        array: Any,
        geometry: Geometry,
        *,
        order: str = "kji",
        padding: tuple[float, float] | None = None,
    ) -> None:
        if not isinstance(geometry, Geometry):
            raise TypeError(f"geometry is a {type(geometry).__name__}; expected a tetwarp.Geometry")
        _calls.word(order, "order", ("kji", "ijk"))
        array = _arrays.require_array(array, "the volume")
        if order == "ijk":
            array = _arrays.turned(array, "the volume")
        shape = tuple(array.shape)
        if len(shape) not in (3, 4) or shape[:3] != geometry.shape:
            raise InputError(f"the volume has the shape {shape}; its geometry has {geometry.shape} (k, j, i)")
        _arrays.require_dense(array, "the volume")
        #: The voxels, [k, j, i] or [k, j, i, c].
        self.array: Any = array
        #: Where they lie.
        self.geometry: Geometry = geometry
        if padding is not None:
            try:
                low, high = (_calls.number(value, "padding") for value in padding)
            except (TypeError, ValueError):
                raise InputError(f"padding is {padding!r}; expected the first and last value that is no data") from None
            if low > high:
                raise InputError(f"padding is {padding!r}; expected the smaller value first")
            padding = (low, high)
        #: First and last of the values that are no data, or None.
        self.padding: tuple[float, float] | None = padding
        #: Value where nothing maps, unless one is given: that of what was read; None: the smallest value.
        self.background: float | None = None
        #: Remarks about what was read.
        self.notes: list[str] = []
        #: Headers of the DICOM series that this volume was read from or derived from, or None.
        self.series: _core.SeriesHeaders | None = None
        #: How a deformed volume was made, for the DICOM series that it becomes.
        self.derivation: Mapping[str, Any] | None = None

    def __repr__(self) -> str:
        return f"<Volume {self.array.dtype} {self.geometry!r}>"

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray[Any, Any]:
        # NumPy below 2 does not know the argument copy.
        return np.asarray(self.array, dtype=dtype) if copy is None else np.array(self.array, dtype=dtype, copy=copy)
