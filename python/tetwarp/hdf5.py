# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Volumes in HDF5: images as ITK and SimpleITK write them, and plain datasets.

    import tetwarp.hdf5
    ct = tetwarp.hdf5.read("ct.h5")

Needs the library h5py, 3.0 or later. It is loaded when a function is called.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from . import _stored
from .errors import InputError
from .files import PathLike, _path
from .geometry import Geometry
from .volume import Volume

#: Where ITK keeps its one image.
_ITK = "ITKImage/0"


def read(
    path: PathLike, *, dataset: str | None = None, geometry: Geometry | None = None, order: str = "kji"
) -> Volume:
    """Reads a volume of HDF5: ITK's image, or a plain dataset.

    Parameters
    ----------
    path : str or path
    dataset : str, optional
        Name of a plain dataset, such as "image"; without it ITK's image is read (its HDF5ImageIO), which states its
        place in LPS mm.
    geometry : Geometry, optional
        Of a plain dataset, which says no place, and of nothing else: where it lies.
    order : "kji" or "ijk"
        Of a plain dataset: how it is indexed. "ijk" is [i, j, k] or [c, i, j, k], as MONAI's arrays are, and is turned
        by a copy.

    Returns
    -------
    Volume
        Array [k, j, i] or [k, j, i, c].

    Raises
    ------
    InputError
        For what cannot be read or is damaged, a place that is missing, and types of voxels that Tetwarp has not.
    ModuleNotFoundError
        Without h5py.

    Examples
    --------
    >>> import tempfile, os, h5py
    >>> import tetwarp as tw
    >>> path = os.path.join(tempfile.mkdtemp(), "case.h5")
    >>> with h5py.File(path, "w") as file:
    ...     file["image"] = np.zeros((4, 3, 2), np.int16)
    >>> read(path, dataset="image", geometry=tw.Geometry((4, 3, 2)), order="ijk").array.shape
    (2, 3, 4)
    """
    h5py, name = _stored.library("h5py", "tetwarp.hdf5", (3, 0)), _path(path)
    if not os.path.exists(name):
        raise InputError(f"no such file, {name}")
    try:
        with h5py.File(name, "r") as file:
            if dataset is None:
                return _itk_image(h5py, file, geometry, order, name)
            return _plain(h5py, file, dataset, geometry, order, name)
    except (OSError, RuntimeError) as error:  # h5py's own; of a file that is cut short, and of filters
        raise InputError(f"{name} cannot be read as HDF5: {_stored.first_line(error)}") from error


def _plain(h5py: Any, file: Any, dataset: str, geometry: Geometry | None, order: str, name: str) -> Volume:
    node = file.get(dataset)
    if not isinstance(node, h5py.Dataset):
        raise InputError(f"{name} has no dataset {dataset!r}; it has {_datasets(h5py, file)}")
    what = f"{name}:{dataset}"
    if geometry is None:
        raise InputError(f"{what} is a plain dataset {node.shape}, which says no place; pass geometry=")
    return _stored.plain_volume(_values(node, what), geometry, order, what)


def _datasets(h5py: Any, file: Any) -> str:
    found: list[str] = []
    file.visititems(lambda each, node: found.append(each) if isinstance(node, h5py.Dataset) else None)
    return ", ".join(found) or "none"


def _values(node: Any, what: str) -> np.ndarray[Any, Any]:
    kind = _stored.native_type(node.dtype, what)
    if node.shape is None:
        raise InputError(f"{what} is empty")
    return np.ascontiguousarray(node[()], dtype=kind)


def _itk_image(h5py: Any, file: Any, geometry: Geometry | None, order: str, name: str) -> Volume:
    image = file.get(_ITK)
    if not isinstance(image, h5py.Group):
        raise InputError(f"{name} has no image of ITK; pass dataset=, one of {_datasets(h5py, file)}, and geometry=")
    if geometry is not None or order != "kji":
        raise InputError(f"{name} is an image of ITK, which states its place; leave out geometry and order")
    voxels = image.get("VoxelData")
    if not isinstance(voxels, h5py.Dataset):
        raise InputError(f"{name} is damaged: {_ITK}/VoxelData is missing")
    size = _numbers(h5py, image, "Dimension", None, name)
    if size.shape != (3,):
        raise InputError(f"{name} holds an image of {size.size} dimensions; expected 3")
    shape = tuple(int(length) for length in size[::-1])
    if voxels.shape is None or voxels.shape[:3] != shape or len(voxels.shape) > 4:
        raise InputError(f"{name} is damaged: its voxels have the shape {voxels.shape}, its Dimension says {shape}")
    # A row of Directions is the unit vector of one axis of the grid; in a Geometry, as in ITK itself, that is a column.
    directions = _numbers(h5py, image, "Directions", (3, 3), name)
    try:
        place = Geometry(
            size.tolist(),
            _numbers(h5py, image, "Spacing", (3,), name).tolist(),
            _numbers(h5py, image, "Origin", (3,), name).tolist(),
            directions.T,
        )
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    return Volume(_values(voxels, f"{name}:{_ITK}/VoxelData"), place)


def _numbers(h5py: Any, image: Any, key: str, shape: tuple[int, ...] | None, name: str) -> np.ndarray[Any, Any]:
    node = image.get(key)
    if not isinstance(node, h5py.Dataset) or node.dtype.kind not in "iuf" or shape not in (None, node.shape):
        raise InputError(f"{name} is damaged: {_ITK}/{key} is missing or malformed")
    return np.asarray(node[()])
