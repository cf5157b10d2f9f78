# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Tensors [i, j, k] of PyTorch, k fastest, and our arrays [k, j, i]; what transforms of tensors share."""

from __future__ import annotations

from typing import Any

import torch

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


class CountsEpochs:
    """A transform that knows the epoch. It lies in shared memory: workers that were started before see it, too."""

    def _count_epochs(self) -> None:
        self._epoch = torch.zeros((), dtype=torch.int64).share_memory_()

    @property
    def epoch(self) -> int:
        """Number of the epoch, 0 at first."""
        return int(self._epoch)

    @epoch.setter
    def epoch(self, number: int) -> None:
        self._epoch.fill_(number)
