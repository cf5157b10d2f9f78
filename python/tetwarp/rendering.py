# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Pictures of volumes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _arrays, _calls, _core, adapters
from .errors import InputError


def render(
    volume: Any,
    *,
    transfer: str = "ct-bone",
    angle: float = 0,
    elevation: float = 0,
    zoom: float = 1,
    size: Sequence[int] = (768, 768),
    step: float | None = None,
    background: Sequence[float] = (0, 0, 0),
    backend: str = "auto",
    device: int = 0,
    threads: int = 0,
    progress: _calls.Progress = False,
) -> npt.NDArray[np.uint8]:
    """Casts parallel rays through a volume.

    Parameters
    ----------
    volume : Volume or image
        Straight and even; one value a voxel.
    transfer : str
        ct-bone, ct-skin, ct-lung, ct-vessel, mip, xray, or the name of a JSON file.
    angle, elevation : float
        Degrees around the patient's long axis (0 from the front, 90 from the patient's left), and above it.
    size : (int, int)
        Columns and rows, pixels.
    step : float, optional
        Distance of samples, 0.01 to 1 of the smallest spacing.
    background : (float, float, float)
        Red, green, blue, 0 to 1.

    Returns
    -------
    array, (rows, columns, 3), uint8
        The same bytes on every backend.

    Examples
    --------
    >>> import tetwarp as tw
    >>> render(tw.phantom((32, 32, 16), spacing=(10, 10, 15)), size=(40, 30)).shape
    (30, 40, 3)
    """
    given, _ = adapters.volume_of(volume)
    try:
        columns, rows = (_calls.whole(value, "size", 1, 2**14) for value in size)
        red, green, blue = (_calls.number(value, "background") for value in background)
    except (TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"size is {size!r}, background is {background!r}; expected (columns, rows) and (red, green, blue)"
        ) from None
    view = _core.View(
        _calls.number(angle, "angle"),
        _calls.number(elevation, "elevation"),
        _calls.number(zoom, "zoom"),
        [columns, rows],
        None if step is None else _calls.number(step, "step"),
        [red, green, blue],
    )
    stream = _arrays.stream_of(given.array, None)
    picture = _core.render(
        _arrays.exchanged(given.array, stream),
        given.geometry._grid,
        str(transfer),
        view,
        backend,
        _calls.whole(device, "device", 0, 1024),
        _calls.threads(threads),
        _calls.options(progress, "render", stream),
    )
    return np.asarray(picture, dtype=np.uint8)
