# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""MetaTensors of MONAI: channel first, [c, i, j, k], k fastest, an affine in RAS. Turned by a copy on the same device."""

from __future__ import annotations

from typing import Any

import torch

from ..geometry import Geometry
from ..volume import Volume
from . import require_values
from .tensors import array_of, tensor_of


def volume_of(image: Any, name: str) -> tuple[Volume, Any]:
    shape = tuple(image.shape)
    if len(shape) != 4:
        raise TypeError(f"{name} has the shape {shape}; expected [channel, i, j, k]")
    require_values(shape[0], name)
    geometry = Geometry.from_affine(image.affine.detach().cpu().numpy(), shape[1:], space="RAS")
    return Volume(array_of(image.as_tensor()[0]), geometry), Back(image)


class Back:
    """Takes a volume to a MetaTensor with the keys of the one that was given."""

    copies = 2

    def __init__(self, image: Any) -> None:
        self._image = image

    def __call__(self, volume: Volume) -> Any:
        meta = dict(self._image.meta)
        affine = torch.as_tensor(volume.geometry.affine("RAS"))
        meta.pop("affine", None)
        return type(self._image)(tensor_of(volume.array)[None], affine=affine, meta=meta, applied_operations=self._image.applied_operations)
