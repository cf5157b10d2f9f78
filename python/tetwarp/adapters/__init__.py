# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Images of other libraries, taken wherever a volume is; the answer has the type of the question.

An object is known by the module that its class comes from. No library is imported unless one of its objects comes in.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

from ..errors import InputError
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


def copies_of(back: Back) -> int:
    """How many arrays were copied for `volume_of`, and will be for its way back."""
    return int(getattr(back, "copies", 0))


def _itself(volume: Volume) -> Volume:
    return volume


def require_values(count: int, name: str) -> None:
    """Refuses an image of several values a voxel where each is a volume of its own."""
    if count != 1:
        raise InputError(f"{name} has {count} channels; expected one, pass each by itself with with_=")
