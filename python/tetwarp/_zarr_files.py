# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""An image of OME-Zarr that is written slab by slab, beside its name until it is complete."""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from . import _arrays, _calls, _ngff, _stored
from .errors import Error, InputError
from .geometry import Geometry
from .volume import Volume

#: Slices that are made at once, at least: thinner slabs are not faster to write.
_SLAB = 32


def library() -> Any:
    """The library zarr; it is loaded when it is needed."""
    return _stored.library("zarr", "tetwarp.zarr", (2, 18))


def has_version_3(zarr: Any) -> bool:
    """Whether the library knows Zarr 3. It has a signature of its own for what it makes then."""
    return int(zarr.__version__.split(".")[0]) >= 3


class Image:
    """The levels of an image, which take slab after slab."""

    def __init__(self, shape: Sequence[int], arrays: list[Any], chunk: int) -> None:
        self._length = shape[0]
        self._arrays = arrays
        self._step = chunk * -(-_SLAB // chunk)

    def slabs(self) -> Iterator[tuple[int, int]]:
        """First slice of each slab, and the one after its last."""
        for first in range(0, self._length, self._step):
            yield first, min(first + self._step, self._length)

    def put(self, first: int, slab: np.ndarray[Any, Any]) -> None:
        """Writes a slab into each level. The first of its slices is the slice `first` of the image."""
        for level, array in enumerate(self._arrays):
            step = 2**level
            skipped = -first % step
            part = slab[skipped::step, ::step, ::step]
            if len(part):
                at = (first + skipped) // step
                array[at : at + len(part)] = part


@contextlib.contextmanager
def written(
    name: str,
    volume: Volume,
    geometry: Geometry,
    space: str,
    chunks: Sequence[int],
    levels: int,
    version: str,
    overwrite: bool,
) -> Iterator[Image]:
    """The image at a path, of the type of a volume and on a grid; it is there when the block ends well."""
    zarr = library()
    _calls.word(version, "version", ("0.5", "0.4"))
    if version == "0.5" and not has_version_3(zarr):
        raise InputError(f'{name}: OME-Zarr 0.5 needs zarr 3, this is {zarr.__version__}; pass version="0.4"')
    try:
        sizes = [_calls.whole(size, "chunks", 1, 2**18) for size in chunks]
    except TypeError:
        sizes = []
    if len(sizes) != 3:
        raise InputError(f"chunks is {chunks!r}; expected three whole numbers (k, j, i)")
    count = _calls.whole(levels, "levels", 1, max(geometry.size).bit_length())
    if len(volume.array.shape) != 3:
        raise InputError(f"{name}: the volume has {volume.array.shape[3]} values a voxel; write each by itself")
    if _arrays.is_on_device(volume.array):
        raise InputError(f"{name}: the volume lies on a device; write a copy in host memory")
    kind = _stored.native_type(volume.array.dtype, "the volume")
    axes, attributes = _ngff.described(geometry, space, count, version, name)
    with _beside(name, overwrite) as folder:
        form = {"zarr_format": 3 if version == "0.5" else 2} if has_version_3(zarr) else {}
        group = zarr.open_group(folder, mode="w", **form)
        arrays = []
        for level in range(count):
            shape = tuple(-(-length // 2**level) for length in geometry.shape)
            chunk = tuple(min(pair) for pair in zip(sizes, shape))
            arrays.append(_array(zarr, group, str(level), shape, chunk, kind, axes, version))
        group.attrs.update(attributes)
        yield Image(geometry.shape, arrays, min(sizes[0], geometry.shape[0]))


def _array(
    zarr: Any,
    group: Any,
    name: str,
    shape: tuple[int, ...],
    chunks: tuple[int, ...],
    kind: np.dtype[Any],
    axes: list[str],
    version: str,
) -> Any:
    """A new array of a group. All of its chunks are written, those of zeros too: one that is missing got lost."""
    if not has_version_3(zarr):
        return group.create_dataset(
            name, shape=shape, chunks=chunks, dtype=kind, fill_value=0, dimension_separator="/", write_empty_chunks=True
        )
    by_version: dict[str, Any] = {"dimension_names": axes}
    if version == "0.4":
        by_version = {"chunk_key_encoding": {"name": "v2", "separator": "/"}}
    return group.create_array(
        name, shape=shape, chunks=chunks, dtype=kind, fill_value=0, config={"write_empty_chunks": True}, **by_version
    )


@contextlib.contextmanager
def _beside(name: str, overwrite: bool) -> Iterator[str]:
    """A new folder beside a path. It takes that name when the block ends well, and goes away when it does not."""
    path = os.path.realpath(name)
    parent = os.path.dirname(path)
    if not os.path.isdir(parent):
        raise Error(
            f"folder {parent} does not exist, so {os.path.basename(path)} cannot be written into it; create it first"
        )
    if os.path.lexists(path):
        if not overwrite:
            raise Error(f"{name} exists; choose another name or pass overwrite=True")
        if not any(os.path.isfile(os.path.join(path, mark)) for mark in ("zarr.json", ".zgroup", ".zarray")):
            raise Error(f"{name} exists and is no folder of Zarr, which alone is replaced; choose another name")
    mark = secrets.token_hex(4)
    made, old = f"{path}.{mark}.new", f"{path}.{mark}.old"
    try:
        os.mkdir(made)
        yield made
        if os.path.lexists(path):
            if not overwrite:
                raise Error(f"{name} came into being while it was written; choose another name")
            os.rename(path, old)
        try:
            os.rename(made, path)
        except OSError:
            if os.path.lexists(old):
                os.rename(old, path)
            raise
    except OSError as error:
        raise Error(f"{name} cannot be written: {_stored.first_line(error)}") from error
    finally:
        shutil.rmtree(made, ignore_errors=True)
        shutil.rmtree(old, ignore_errors=True)
