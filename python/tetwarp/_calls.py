# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What calls that may take long have in common: progress, threads, streams."""

from __future__ import annotations

import operator
import sys
from collections.abc import Callable
from typing import Any, Union

from . import _core
from .errors import InputError

#: False: nothing is shown. True: tqdm's bar, where tqdm is installed. Or what gets the share that is done, 0 to 1.
Progress = Union[bool, Callable[[float], object]]


class _Bar:
    """tqdm's bar as a callable."""

    def __init__(self, title: str) -> None:
        from tqdm.auto import tqdm

        self._bar = tqdm(total=100, desc=title, unit="%", leave=False)

    def __call__(self, share: float) -> None:
        self._bar.update(round(100 * share) - self._bar.n)
        if share >= 1:
            self._bar.close()


def shown(progress: Progress, title: str) -> Callable[[float], object] | None:
    """What gets the share that is done: of True tqdm's bar, where tqdm is installed."""
    if callable(progress):
        return progress
    if progress is True:
        try:
            return _Bar(title)
        except ImportError:
            return None
    if progress is not False:
        raise TypeError(f"progress is {progress!r}; expected True, False or a callable")
    return None


def options(progress: Progress, title: str, stream: int = 0) -> _core.CallOptions:
    """What the binding is given for one call."""
    return _core.CallOptions(shown(progress, title), stream)


def threads(wished: int) -> int:
    """Threads of one call: what is wished; of 0 all, but one in a worker of PyTorch's DataLoader."""
    number = whole(wished, "threads", 0, 4096)
    data = sys.modules.get("torch.utils.data")
    if number == 0 and data is not None and data.get_worker_info() is not None:
        return 1
    return number


def word(value: Any, name: str, words: tuple[str, ...], *, optional: bool = False) -> str | None:
    """One of several words, or None where that is allowed."""
    if (optional and value is None) or (isinstance(value, str) and value in words):
        return value
    expected = " or ".join(f'"{one}"' for one in words) + (", or None" if optional else "")
    raise InputError(f"{name} is {value!r}; expected {expected}")


def whole(value: Any, name: str, least: int, most: int) -> int:
    """A whole number in a range."""
    try:
        number = operator.index(value)
    except TypeError:
        raise InputError(f"{name} is {value!r}; expected a whole number") from None
    if not least <= number <= most:
        raise InputError(f"{name} is {value!r}; expected a whole number from {least} to {most}")
    return number


def number(value: Any, name: str) -> float:
    """A finite number."""
    try:
        result = float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} is {value!r}; expected a number") from None
    if result - result != 0:
        raise InputError(f"{name} is {value!r}; expected a finite number")
    return result


_UNITS = {"": 1, "k": 10**3, "m": 10**6, "g": 10**9, "t": 10**12, "ki": 2**10, "mi": 2**20, "gi": 2**30, "ti": 2**40}


def memory_bytes(size: Any) -> int:
    """Bytes of a size such as 2e9, "2G" or "1.5Gi"; None: 0, no limit."""
    if size is None:
        return 0
    if isinstance(size, str):
        text = size.strip().lower().rstrip("b")
        digits = text.rstrip("kmgti")
        unit = text[len(digits) :]
        if unit not in _UNITS:
            raise InputError(f'memory is {size!r}; expected bytes, or a size such as "2G"')
        size = number(digits, "memory") * _UNITS[unit]
    size = number(size, "memory")
    if not 1 <= size <= 2**62:
        raise InputError(f"memory is {size!r}; expected bytes above 0")
    return int(size)
