# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Images of SimpleITK: [k, j, i], LPS, i fastest, as ours. Reading copies nothing; a result is copied into an image."""

from __future__ import annotations

from typing import Any

import numpy as np
import SimpleITK as sitk  # noqa: N813

from ..geometry import Geometry
from ..volume import Volume


def volume_of(image: Any, name: str) -> tuple[Volume, Any]:
    if not isinstance(image, sitk.Image):
        raise TypeError(f"{name} is a {type(image).__name__} of SimpleITK; expected an image")
    if image.GetDimension() != 3:
        raise TypeError(f"{name} has {image.GetDimension()} dimensions; expected 3")
    direction = [image.GetDirection()[3 * row : 3 * row + 3] for row in range(3)]
    geometry = Geometry(image.GetSize(), image.GetSpacing(), image.GetOrigin(), direction)
    view = np.asarray(_Held(sitk.GetArrayViewFromImage(image), image))
    return Volume(view, geometry), Back(image)


def vector_image(geometry: Geometry, displacement: Any) -> Any:
    """An image of vectors of float64, as `SimpleITK.DisplacementFieldTransform` takes it."""
    image = sitk.GetImageFromArray(np.asarray(displacement, np.float64), isVector=True)
    _place(image, geometry)
    return image


def _place(image: Any, geometry: Geometry) -> None:
    image.SetSpacing(geometry.spacing)
    image.SetOrigin(geometry.origin)
    image.SetDirection(geometry.direction.ravel().tolist())


class _Held:
    """Memory of an image, which it keeps: SimpleITK's own views do not, and NumPy keeps what it takes an array from."""

    def __init__(self, view: Any, image: Any) -> None:
        self.__array_interface__ = view.__array_interface__
        self._kept = (view, image)


class Back:
    """Takes a volume to a SimpleITK image with the keys of the one that was given."""

    copies = 1

    def __init__(self, image: Any) -> None:
        self._image = image

    def __call__(self, volume: Volume) -> Any:
        image = sitk.GetImageFromArray(volume.array, isVector=self._image.GetPixelID() >= sitk.sitkVectorUInt8)
        _place(image, volume.geometry)
        for key in self._image.GetMetaDataKeys():
            image.SetMetaData(key, self._image.GetMetaData(key))
        return image
