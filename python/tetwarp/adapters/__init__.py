# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Images of other libraries, taken wherever a volume is; the answer has the type of the question.

An object is known by the module that its class comes from. No library is imported unless one of its objects comes in.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import InputError
from ..geometry import Geometry
from ..volume import Volume

#: Takes a deformed volume to the type of what was given.
Back = Callable[[Volume], Any]

#: Package of a class, and the module here that knows its images.
_MODULES = {
    "SimpleITK": "simpleitk",
    "itk": "itk_images",
    "nibabel": "nibabel_images",
    "monai": "monai_images",
    "torchio": "torchio_images",
}


def volume_of(value: Any, *, name: str = "the volume") -> tuple[Volume, Back]:
    """The volume of an image, and what takes a deformed one back to the image's type.

    Parameters
    ----------
    value : Volume, SimpleITK.Image, itk.Image, nibabel image, MONAI MetaTensor, TorchIO image
    name : str
        What messages call it.

    Raises
    ------
    TypeError
        For an array without a geometry, and other objects.
    """
    if isinstance(value, Volume):
        return value, _itself
    for base in type(value).__mro__:
        module = _MODULES.get(base.__module__.split(".")[0])
        if module is not None:
            adapter = importlib.import_module(f".{module}", __name__)
            result: tuple[Volume, Back] = adapter.volume_of(value, name)
            return result
    if hasattr(value, "shape") and hasattr(value, "dtype"):
        raise TypeError(f"{name} is an array, which says no place; pass tetwarp.Volume(array, geometry)")
    raise TypeError(
        f"{name} is a {type(value).__name__}; expected a tetwarp.Volume, or an image of SimpleITK, itk, nibabel, MONAI "
        "or TorchIO"
    )


#: Libraries whose images of vectors say displacements along x, y and z in LPS mm.
_VECTORS_IN_LPS = ("SimpleITK", "itk")


def displacement_of(image: Any) -> tuple[Geometry, np.ndarray[Any, Any]]:
    """Grid and displacement of an image of vectors of SimpleITK or itk, as float32; float64 is rounded.

    Raises
    ------
    TypeError
        For images of other libraries, which do not say along which axes their vectors lie.
    InputError
        For an image that has not three real values a voxel.
    """
    if type(image).__module__.split(".")[0] not in _VECTORS_IN_LPS:
        raise TypeError(
            f"the field is a {type(image).__name__}; expected an image of vectors of SimpleITK or itk, others do not say "
            "the axes of their vectors: pass the geometry and the displacement, x, y, z in LPS mm"
        )
    volume, _ = volume_of(image, name="the field")
    array = volume.array
    if array.ndim != 4 or array.shape[3] != 3 or array.dtype.kind != "f":
        raise InputError(
            f"the field holds {1 if array.ndim < 4 else array.shape[3]} x {array.dtype} a voxel; expected 3 x float32 or float64"
        )
    return volume.geometry, array.astype(np.float32, copy=False)


def copies_of(back: Back) -> int:
    """How many arrays were copied for `volume_of`, and will be for its way back."""
    return int(getattr(back, "copies", 0))


def _itself(volume: Volume) -> Volume:
    return volume


def require_values(count: int, name: str) -> None:
    """Refuses an image of several values a voxel where each is a volume of its own."""
    if count != 1:
        raise InputError(f"{name} has {count} channels; expected one, pass each by itself with with_=")
