# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Transforms of TorchIO: one deformation for all images of a subject, exact, with a certificate.

    from tetwarp.torchio import RandomTetwarp
    RandomTetwarp(tw.augmentation.ElasticAffine(), p=0.5)

Needs TorchIO 0.19 or later. Families and certificates: docs/guide/learning.md.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping
from typing import Any

import torch
import torchio
from torchio.transforms.augmentation import RandomTransform
from torchio.transforms.spatial_transform import SpatialTransform

from . import _calls
from .adapters.tensors import DrawsWarps, array_of, readable, tensor_of
from .augmentation import Family, Warp, draw
from .geometry import Geometry
from .volume import Volume

CERTIFICATE = "tetwarp_certificate"


class Tetwarp(SpatialTransform):
    """Deforms the images of a subject by one field that was drawn before, each on its own grid; label maps by vote.

    The inverse pulls each image back by the forward map, evaluated at the centre of every voxel. The subject gets a
    certificate under "tetwarp_certificate", as a text of JSON: that of the last such transform, empty where it was not
    deformed or pulled back.

    Parameters
    ----------
    record : dict
        What is done: `Warp.record`, or a certificate.
    interpolation : "linear" or "cubic"
        Of images that are no label maps.
    background : float, optional
        Of those, where nothing maps; None: the smallest value of each channel.
    """

    def __init__(
        self,
        record: Mapping[str, Any],
        interpolation: str = "linear",
        background: float | None = None,
        threads: int = 0,
        **kwargs: Any,
    ) -> None:
        super().__init__(**kwargs)
        _calls.word(interpolation, "interpolation", ("linear", "cubic"))
        Warp.of_record(record)  # refuses what is none
        self.record = dict(record)
        self.interpolation = interpolation
        self.background = background
        self.threads = threads
        self.invert_transform = False
        self.args_names = ["record", "interpolation", "background", "threads"]

    def apply_transform(self, subject: Any) -> Any:
        """Deforms a subject, or pulls it back."""
        images = subject.get_images_dict(intensity_only=False, include=self.include, exclude=self.exclude)
        labels = {name: one for name, one in images.items() if isinstance(one, torchio.LabelMap)}
        plain = {name: one for name, one in images.items() if name not in labels}
        warp = Warp.of_record(self.record)
        volumes = {name: _volumes_of(one, name) for name, one in images.items()}
        if self.invert_transform:
            for name, one in images.items():
                kind, background = ("vote", 0.0) if name in labels else (self.interpolation, self.background)
                _fill(one, [warp.undo(each, interpolation=kind, background=background) for each in volumes[name]])
            subject[CERTIFICATE] = ""
            return subject
        if not images:
            return subject
        done = warp.deform(
            *(each for name in plain for each in volumes[name]),
            labels=[each for name in labels for each in volumes[name]],
            interpolation=self.interpolation,
            backgrounds=[self.background for name in plain for _ in volumes[name]],
            threads=self.threads,
        )
        for some, results in ((plain, iter(done.images)), (labels, iter(done.labels))):
            for name, one in some.items():
                _fill(one, [next(results) for _ in volumes[name]])
        self.record |= done.certificate  # says how often it was shrunk, for the history
        subject[CERTIFICATE] = json.dumps(self.record)
        return subject


class RandomTetwarp(DrawsWarps, RandomTransform, SpatialTransform):
    """Deforms the images of a subject by one random field; `Tetwarp` stands for it in the subject's history.

    Parameters
    ----------
    family : Family
        What is drawn (`tetwarp.augmentation`), over the grid of the subject's first image.
    interpolation, background
        As of `Tetwarp`.
    cell_size : int
        Voxels between vertices; with smaller cells the field is smoother, and takes longer.
    seed, seed_key : int, key
        With both, a subject is deformed by what `seed`, `epoch` and `subject[seed_key]`, a text or a whole number, say:
        workers and order change nothing. Several such transforms of a pipeline want a seed each; whether it is deformed, TorchIO's own random state decides by `p`. Without `seed_key` that decides all.

    Attributes
    ----------
    epoch : int
        To be counted on by the training loop, where `seed_key` is used. Workers see it at once.

    Examples
    --------
    >>> RandomTetwarp(p=0.5).probability
    0.5
    """

    def __init__(
        self,
        family: Family | None = None,
        *,
        interpolation: str = "linear",
        background: float | None = None,
        cell_size: int = 8,
        seed: int = 0,
        seed_key: str | None = None,
        threads: int = 0,
        **kwargs: Any,
    ) -> None:
        super().__init__(**kwargs)
        self._keep(family, interpolation, background, cell_size, seed, seed_key, threads)

    def __call__(self, data: Any) -> Any:
        """Deforms a subject or what else TorchIO takes, or leaves it."""
        result = super().__call__(data)
        if isinstance(result, torchio.Subject) and CERTIFICATE not in result:  # batches want it of all subjects
            result = copy.copy(result)
            result[CERTIFICATE] = ""
        return result

    def apply_transform(self, subject: Any) -> Any:
        """Draws a field, and deforms a subject by it."""
        images = list(self.get_images(subject))
        if not images:
            return subject
        seed = int(torch.randint(2**62, (1,))) if self.seed_key is None else self._seed_of(subject)
        warp = draw(self.family, _geometry_of(images[0]), seed=seed, cell_size=self.cell_size)
        record = {**warp.record(), "seed": seed}
        if self.seed_key is not None:
            record["epoch"] = self.epoch
        transform = Tetwarp(
            record, self.interpolation, self.background, self.threads, include=self.include, exclude=self.exclude,
            copy=self.copy,
        )  # fmt: skip
        return transform(subject)


def _geometry_of(image: Any) -> Geometry:
    return Geometry.from_affine(image.affine, tuple(image.spatial_shape), space="RAS")


def _volumes_of(image: Any, name: str) -> list[Volume]:
    """The channels."""
    data, geometry = image.data, _geometry_of(image)  # the data first: an image is read when it is touched
    return [Volume(array_of(channel), geometry) for channel in readable(data, repr(name))]


def _fill(image: Any, channels: list[Volume]) -> None:
    """Gives an image other channels on the same grid."""
    image.set_data(torch.stack([tensor_of(channel.array) for channel in channels]).to(image.data.dtype))
