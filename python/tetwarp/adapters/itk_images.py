# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Images of itk: [k, j, i], LPS, i fastest, as ours. Reading copies nothing; a result is copied into an image."""

from __future__ import annotations

from typing import Any

import itk
import numpy as np

from ..geometry import Geometry
from ..volume import Volume


def volume_of(image: Any, name: str) -> tuple[Volume, Any]:
    if not hasattr(image, "GetBufferedRegion"):
        raise TypeError(f"{name} is a {type(image).__name__} of itk; expected an image")
    if image.GetImageDimension() != 3:
        raise TypeError(f"{name} has {image.GetImageDimension()} dimensions; expected 3")
    array = itk.array_view_from_image(image)
    region = image.GetBufferedRegion()  # which is what the array shows; its first voxel need not be that of the origin
    geometry = Geometry(
        [int(value) for value in region.GetSize()],
        [float(value) for value in image.GetSpacing()],
        [float(value) for value in image.TransformIndexToPhysicalPoint(region.GetIndex())],
        np.asarray(itk.array_from_matrix(image.GetDirection())),
    )
    return Volume(array, geometry), Back(image)


class Back:
    """Takes a volume to an itk image of its type."""

    copies = 1

    def __init__(self, image: Any) -> None:
        self._image = image

    def __call__(self, volume: Volume) -> Any:
        image = itk.image_from_array(np.ascontiguousarray(volume.array), ttype=type(self._image))
        image.SetMetaDataDictionary(self._image.GetMetaDataDictionary())
        geometry = volume.geometry
        image.SetSpacing(geometry.spacing)
        image.SetOrigin(geometry.origin)
        image.SetDirection(itk.matrix_from_array(np.array(geometry.direction)))
        return image
