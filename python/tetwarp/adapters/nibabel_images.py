# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Images of nibabel: [i, j, k], RAS. An array in Fortran order, as nibabel reads it, is taken without a copy."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import InputError
from ..geometry import Geometry
from ..volume import Volume
from . import require_values


def volume_of(image: Any, name: str) -> tuple[Volume, Any]:
    shape = tuple(image.shape)
    if len(shape) == 4:
        require_values(shape[3], name)
    elif len(shape) != 3:
        raise InputError(f"{name} has the shape {shape}; expected three axes")
    # Of values that are scaled nibabel makes floating-point numbers; those that are not keep their type.
    array = np.asanyarray(image.dataobj).reshape(shape[:3], order="A")
    copies = 0
    if not array.flags.f_contiguous:
        array = np.asfortranarray(array)
        copies = 1
    if not array.dtype.isnative:
        array = array.astype(array.dtype.newbyteorder("="), order="F")
        copies = 1
    geometry = Geometry.from_affine(image.affine, shape[:3], space="RAS")
    return Volume(array, geometry, order="ijk"), Back(image, copies)


class Back:
    """Takes a volume to an image of the class that was given, whose array is the volume's memory."""

    def __init__(self, image: Any, copies: int) -> None:
        self._image = image
        self.copies = copies

    def __call__(self, volume: Volume) -> Any:
        header = self._image.header.copy()
        header.set_data_dtype(volume.array.dtype)
        if hasattr(header, "set_slope_inter"):
            header.set_slope_inter(1, 0)
        return type(self._image)(volume.array.T, volume.geometry.affine("RAS"), header)
