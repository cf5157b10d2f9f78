# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Images of TorchIO: [c, i, j, k], k fastest, an affine in RAS. Turned by a copy."""

from __future__ import annotations

from typing import Any

from ..geometry import Geometry
from ..volume import Volume
from . import require_values
from .tensors import array_of, tensor_of


def volume_of(image: Any, name: str) -> tuple[Volume, Any]:
    data = image.data
    require_values(int(data.shape[0]), name)
    geometry = Geometry.from_affine(image.affine, tuple(data.shape[1:]), space="RAS")
    return Volume(array_of(data[0]), geometry), Back(image)


class Back:
    """Takes a volume to an image of the class that was given: labels stay labels."""

    copies = 2

    def __init__(self, image: Any) -> None:
        self._image = image

    def __call__(self, volume: Volume) -> Any:
        return type(self._image)(tensor=tensor_of(volume.array)[None], affine=volume.geometry.affine("RAS"))
