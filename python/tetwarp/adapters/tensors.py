# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Tensors [i, j, k] of PyTorch, k fastest, and our arrays [k, j, i]."""

from __future__ import annotations

from typing import Any

import torch


def array_of(tensor: Any) -> Any:
    """A copy [k, j, i], i fastest: NumPy's on the host, a tensor on a device."""
    turned = tensor.detach().permute(2, 1, 0).contiguous()
    return turned if turned.is_cuda else turned.numpy()


def tensor_of(array: Any) -> Any:
    """A copy [i, j, k], k fastest, on the same device."""
    tensor = torch.as_tensor(array)
    return tensor.permute(2, 1, 0).contiguous()
