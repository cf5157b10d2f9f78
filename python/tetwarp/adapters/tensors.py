# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Tensors [i, j, k] of PyTorch, k fastest, and our arrays [k, j, i]; what transforms of tensors share."""

from __future__ import annotations

from typing import Any

import torch

from .. import _calls
from ..augmentation import Elastic, Family, seed_of
from ..errors import InputError


#: Types that are read as others, which hold their values.
_READ_AS = {torch.bool: torch.uint8, torch.float16: torch.float32, torch.bfloat16: torch.float32}


def readable(tensor: Any, name: str) -> Any:
    """The tensor in a type that is deformed; its own, for most."""
    if tensor.dtype == torch.int64:
        if tensor.numel() and (tensor.min() < -(2**31) or tensor.max() >= 2**31):
            raise InputError(f"{name} holds whole numbers beyond 32 bits")
        return tensor.to(torch.int32)
    return tensor.to(_READ_AS.get(tensor.dtype, tensor.dtype))


def array_of(tensor: Any) -> Any:
    """A copy [k, j, i], i fastest: NumPy's on the host, a tensor on a device."""
    turned = tensor.detach().permute(2, 1, 0).contiguous()
    return turned if turned.is_cuda else turned.numpy()


def tensor_of(array: Any) -> Any:
    """A copy [i, j, k], k fastest, on the same device."""
    tensor = torch.as_tensor(array)
    return tensor.permute(2, 1, 0).contiguous()


class DrawsWarps:
    """A transform that draws a deformation for each sample, and knows the epoch.

    The epoch lies in shared memory: workers that were started before see it, too.
    """

    def _keep(
        self,
        family: Family | None,
        interpolation: str,
        background: float | None,
        cell_size: int,
        seed: int,
        seed_key: Any,
        threads: int,
    ) -> None:
        """Keeps the options of a transform; refuses words and numbers that do not fit."""
        _calls.word(interpolation, "interpolation", ("linear", "cubic"))
        self.family = Elastic() if family is None else family
        self.interpolation = interpolation
        self.background = background
        self.cell_size = _calls.whole(cell_size, "cell_size", 1, 65536)
        self.seed = _calls.whole(seed, "seed", 0, 2**63 - 1)
        self.seed_key = seed_key
        self.threads = threads
        self._epoch = torch.zeros((), dtype=torch.int64).share_memory_()

    def _seed_of(self, sample: Any) -> int:
        """The seed of a sample, by its `seed_key`."""
        if self.seed_key not in sample:
            raise InputError(f"the sample has no {self.seed_key!r}, which seed_key names")
        return seed_of(self.seed, self.epoch, sample[self.seed_key])

    @property
    def epoch(self) -> int:
        """Number of the epoch, 0 at first."""
        return int(self._epoch)

    @epoch.setter
    def epoch(self, number: int) -> None:
        self._epoch.fill_(number)
