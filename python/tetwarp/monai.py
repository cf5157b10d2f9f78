# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""A transform of MONAI: one random deformation for all keys of a sample, exact, with a certificate.

    from tetwarp.monai import RandTetwarpd
    RandTetwarpd(keys=["image", "label"], labels=["label"], family=tw.augmentation.Elastic(), prob=0.5)

Needs MONAI 1.2 or later. Families and certificates: docs/guide/learning.md.
"""

from __future__ import annotations

import json
from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import torch
from monai.data.meta_tensor import MetaTensor
from monai.transforms.inverse import InvertibleTransform
from monai.transforms.lazy.functional import apply_pending
from monai.transforms.transform import MapTransform, RandomizableTransform
from monai.utils.misc import ensure_tuple

from .adapters.tensors import DrawsWarps, array_of, readable, tensor_of
from .augmentation import Family, Warp, draw
from .errors import InputError
from .geometry import Geometry
from .volume import Volume


class RandTetwarpd(DrawsWarps, RandomizableTransform, MapTransform, InvertibleTransform):
    """Deforms the keys of a sample by one random field, each on its own grid.

    Operations that are pending on a key are applied first. `inverse` pulls each key back by the forward map, evaluated at
    the centre of every voxel.

    Parameters
    ----------
    keys : sequence
        Keys of MetaTensors [c, i, j, k]. The first that a sample has decides the grid over which the field is drawn.
    family : Family
        What is drawn (`tetwarp.augmentation`).
    labels : sequence
        Keys of labels, among `keys`; they go by vote.
    interpolation : "linear" or "cubic"
        Of the other keys.
    background : float, optional
        Of the other keys, where nothing maps; None: the smallest value of each channel.
    prob : float
        How often a sample is deformed.
    cell_size : int
        Voxels between vertices; with smaller cells the field is smoother, and takes longer.
    seed, seed_key : int, key
        With both, a sample is deformed by what `seed`, `epoch` and `sample[seed_key]`, a text or a whole number, say:
        workers and order change nothing. Several such transforms of a pipeline want a seed each. Without `seed_key`
        MONAI's own random state decides.
    certificate_key : str or None
        Where the sample gets its certificate, as a text of JSON; an empty text where it was not deformed.

    Attributes
    ----------
    epoch : int
        To be counted on by the training loop, where `seed_key` is used. Workers see it at once.

    Raises
    ------
    InputError
        For words and numbers that do not fit.

    Examples
    --------
    >>> RandTetwarpd(["image", "label"], labels=["label"], prob=1.0).prob
    1.0
    """

    def __init__(
        self,
        keys: Sequence[Hashable] | Hashable,
        family: Family | None = None,
        *,
        labels: Sequence[Hashable] | Hashable = (),
        interpolation: str = "linear",
        background: float | None = None,
        prob: float = 0.1,
        cell_size: int = 8,
        seed: int = 0,
        seed_key: Hashable | None = None,
        certificate_key: str | None = "tetwarp_certificate",
        allow_missing_keys: bool = False,
        threads: int = 0,
    ) -> None:
        MapTransform.__init__(self, keys, allow_missing_keys)
        RandomizableTransform.__init__(self, prob)
        self._keep(family, interpolation, background, cell_size, seed, seed_key, threads)
        self.labels: tuple[Hashable, ...] = tuple(ensure_tuple(labels))
        unknown = [key for key in self.labels if key not in self.keys]
        if unknown:
            raise InputError(f"labels names {unknown[0]!r}, which is not among keys")
        self.certificate_key = certificate_key

    def randomize(self, data: Mapping[Hashable, Any]) -> int:  # type: ignore[override]
        """Whether a sample is deformed, and the seed of its field."""
        if self.seed_key is None:
            super().randomize(None)
            return int(self.R.randint(2**31))
        seed = self._seed_of(data)
        self._do_transform = seed / 2**63 < self.prob
        return seed

    def __call__(self, data: Mapping[Hashable, Any]) -> dict[Hashable, Any]:
        """Deforms a sample."""
        sample = dict(data)
        keys = list(self.key_iterator(sample))
        for key in keys:
            sample[key] = _ready(sample[key], key)
        seed = self.randomize(sample)
        certificate = ""
        if keys and self._do_transform:
            warp = draw(self.family, _geometry_of(sample[keys[0]]), seed=seed, cell_size=self.cell_size)
            images = [key for key in keys if key not in self.labels]
            volumes = {key: _volumes_of(sample[key], key) for key in keys}
            done = warp.deform(
                *(one for key in images for one in volumes[key]),
                labels=[one for key in keys if key in self.labels for one in volumes[key]],
                interpolation=self.interpolation,
                backgrounds=[self.background for key in images for _ in volumes[key]],
                threads=self.threads,
            )
            of_seed = {"seed": seed} if self.seed_key is None else {"seed": seed, "epoch": self.epoch}
            certificate = json.dumps({**done.certificate, **of_seed})
            of_images, of_labels = iter(done.images), iter(done.labels)
            for key in keys:
                results = of_labels if key in self.labels else of_images
                sample[key] = _tensor_like(sample[key], [next(results) for _ in volumes[key]])
        for key in keys:
            mode = "nearest" if key in self.labels else "bilinear"  # as MONAI's Invertd may change it
            self.push_transform(sample[key], extra_info={"certificate": certificate, "mode": mode})
        if self.certificate_key is not None:
            sample[self.certificate_key] = certificate
        return sample

    def inverse(self, data: Mapping[Hashable, Any]) -> dict[Hashable, Any]:
        """Pulls a sample back."""
        sample = dict(data)
        for key in self.key_iterator(sample):
            done = self.pop_transform(sample[key])["extra_info"]
            if not done["certificate"]:
                continue
            warp = Warp.of_record(json.loads(done["certificate"]))
            kind, background = ("vote", 0.0) if done["mode"] == "nearest" else (self.interpolation, self.background)
            back = [warp.undo(one, interpolation=kind, background=background) for one in _volumes_of(sample[key], key)]
            sample[key] = _tensor_like(sample[key], back)
        return sample


def _ready(image: Any, key: Hashable) -> Any:
    """A MetaTensor on which nothing is pending."""
    if not isinstance(image, MetaTensor):
        raise TypeError(f"{key!r} is a {type(image).__name__}; expected a MetaTensor, whose affine says where voxels lie")
    if image.pending_operations:
        image, _ = apply_pending(image)
    if image.dim() != 4:
        raise TypeError(f"{key!r} has the shape {tuple(image.shape)}; expected [channel, i, j, k]")
    return image


def _geometry_of(image: Any) -> Geometry:
    return Geometry.from_affine(image.affine.detach().cpu().numpy(), tuple(image.shape)[1:], space="RAS")


def _volumes_of(image: Any, key: Hashable) -> list[Volume]:
    """The channels."""
    geometry = _geometry_of(image)
    return [Volume(array_of(channel), geometry) for channel in readable(image.as_tensor(), repr(key))]


def _tensor_like(image: Any, channels: Sequence[Volume]) -> Any:
    """A MetaTensor of channels, with all that another one knows."""
    tensor = torch.stack([tensor_of(channel.array) for channel in channels]).to(image)
    meta = {key: value for key, value in image.meta.items() if key != "affine"}
    operations = list(image.applied_operations)
    return type(image)(tensor, affine=image.affine.clone(), meta=meta, applied_operations=operations)
