# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What arrays in files of Zarr and HDF5 have in common."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from . import _arrays, _calls
from .errors import InputError
from .geometry import Geometry
from .volume import Volume

#: Types of voxels that Tetwarp computes with.
_TYPES = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64")


def library(name: str, user: str, version: tuple[int, ...]) -> Any:
    """A library that is loaded when it is needed.

    Raises
    ------
    ModuleNotFoundError
        Where it is missing; the text has the name that pip knows.
    ImportError
        Where it is older than `version`.
    """
    wanted = ".".join(map(str, version))
    try:
        module = importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name != name:  # the library is there, and misses one of its own
            raise
        raise ModuleNotFoundError(
            f"{user} needs the library {name}, {wanted} or later: pip install {name}", name=name
        ) from None
    found = tuple(int(part) for part in module.__version__.split(".")[: len(version)])
    if found < version:
        raise ImportError(f"{user} needs {name} {wanted} or later; this is {module.__version__}: pip install -U {name}")
    return module


def native_type(kind: Any, what: str) -> np.dtype[Any]:
    """The type of voxels in this machine's order of bytes, if Tetwarp has it."""
    if not isinstance(kind, np.dtype) or kind.newbyteorder("=").name not in _TYPES:
        raise InputError(f"{what} holds {kind}; expected {', '.join(_TYPES)}: store it as one of these")
    return kind.newbyteorder("=")


def plain_volume(values: np.ndarray[Any, Any], geometry: Geometry, order: str, what: str) -> Volume:
    """The volume of an array that says no place of its own.

    Parameters
    ----------
    values : array
        In host memory, of a type that Tetwarp has; nobody else uses it.
    order : "kji" or "ijk"
        "ijk": it is indexed [i, j, k] or [c, i, j, k], and is turned by a copy unless it lies in Fortran order.
    """
    _calls.word(order, "order", ("kji", "ijk"))
    if not isinstance(geometry, Geometry):
        raise TypeError(f"geometry is a {type(geometry).__name__}; expected a tetwarp.Geometry")
    turned = _arrays.turned(values, what) if order == "ijk" else values
    if turned.ndim not in (3, 4) or turned.shape[:3] != geometry.shape:
        wanted = geometry.shape if order == "kji" else geometry.size
        raise InputError(
            f'{what} has the shape {values.shape}; its geometry has {wanted} in the order "{order}": pass another '
            'geometry, or order= "kji" or "ijk"'
        )
    return Volume(np.ascontiguousarray(turned), geometry)


def first_line(error: BaseException) -> str:
    """What an error of another library says, in one line."""
    text = str(error).strip()
    return text.splitlines()[0] if text else type(error).__name__
