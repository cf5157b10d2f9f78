# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Volumes in Zarr and OME-Zarr (NGFF 0.4 and 0.5), and deforming from one into another, slab by slab.

    import tetwarp.zarr
    ct = tetwarp.zarr.read("ct.ome.zarr", space="LPS")

Needs the library zarr, 2.18 or later; OME-Zarr 0.5 needs zarr 3. It is loaded when a function is called.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import _calls, _ngff, _stored, _zarr_files, adapters
from .deforming import _grid_of, _notes_of, _resampler_of
from .errors import InputError
from .field import PullField, VertexField, require_forward, require_pull
from .files import PathLike, _path
from .geometry import Geometry
from .report import Report
from .resampler import Target
from .volume import Volume


def read(
    path: PathLike,
    *,
    level: int = 0,
    index: Mapping[str, int] | None = None,
    space: str | None = None,
    unit: str | None = None,
    geometry: Geometry | None = None,
    order: str = "kji",
) -> Volume:
    """Reads a volume of OME-Zarr (0.4 or 0.5), or a plain array of Zarr, into memory.

    Chunks that are not in the folder hold the fill value, as Zarr has it; the volume's `notes` count them.

    Parameters
    ----------
    path : str or path
        The group of an image, or an array.
    level : int
        Of OME-Zarr: 0 is the finest.
    index : dict, optional
        Of OME-Zarr: the place along each further axis, as `{"t": 0, "c": 1}`. An axis of length 1 needs none.
    space : "LPS" or "RAS"
        Of OME-Zarr, which does not say it: the frame of x, y and z. No axis is turned: the array stays as it lies in
        the file, and the geometry says where its axes grow.
    unit : str, optional
        Of OME-Zarr: "nanometer", "micrometer", "millimeter", "centimeter" or "meter", of axes that state no unit or one
        that is not among these. Lengths become mm.
    geometry : Geometry, optional
        Of a plain array, which says no place, and of nothing else: where it lies.
    order : "kji" or "ijk"
        Of a plain array: how it is indexed. "ijk" is turned by a copy.

    Returns
    -------
    Volume
        Array [k, j, i]; of a plain array also [k, j, i, c].

    Raises
    ------
    InputError
        For what cannot be read or is damaged, a choice that is missing, and types of voxels that Tetwarp has not.
    ModuleNotFoundError
        Without zarr.

    Examples
    --------
    >>> import tempfile, os
    >>> import tetwarp as tw
    >>> path = os.path.join(tempfile.mkdtemp(), "ct.ome.zarr")
    >>> write(tw.phantom((8, 8, 4)), path, version="0.4")
    >>> read(path, space="LPS").geometry == tw.phantom((8, 8, 4)).geometry
    True
    """
    zarr, name = _zarr_files.library(), _path(path)
    node = _opened(zarr, name)
    if hasattr(node, "shape"):
        if geometry is None:
            raise InputError(f"{name} is a plain array of Zarr {node.shape}, which says no place; pass geometry=")
        if level or index or space or unit:
            raise InputError(f"{name} is a plain array of Zarr; level, index, space and unit are of OME-Zarr")
        values = _values(node, Ellipsis, name)
        volume = _stored.plain_volume(values, geometry, order, name)
        volume.notes = _missing_chunks(node, name)
        return volume
    if geometry is not None or order != "kji":
        raise InputError(f"{name} is a group; geometry= and order= are of a plain array: leave them out, or name one")
    attributes = dict(node.attrs)
    if "ome" not in attributes and "multiscales" not in attributes:
        raise InputError(f"{name} is a group of Zarr without an image of OME-Zarr; name one in it: {_members(node)}")
    image = _ngff.multiscale_of(attributes, name)
    if not isinstance(level, (int, np.integer)) or not 0 <= level < len(image.levels):
        raise InputError(f"level is {level!r}; {name} has 0 to {len(image.levels) - 1}")
    one = image.levels[level]
    what = f"{name}/{one.path}"
    array = _member(node, one.path, what)
    picked = _ngff.selection_of(image.axes, array.shape, index, name)
    place = _ngff.geometry_of(image.axes, one, array.shape, space, unit, name)
    volume = Volume(_values(array, picked, what), place)
    volume.notes = _missing_chunks(array, what)
    return volume


def _opened(zarr: Any, name: str) -> Any:
    """The array or group of a path, for reading."""
    if not os.path.exists(name):
        raise InputError(f"no such file or folder, {name}")
    if not _zarr_files.has_version_3(zarr) and os.path.exists(os.path.join(name, "zarr.json")):
        raise InputError(f"{name} is of Zarr 3, and this is zarr {zarr.__version__}; pip install 'zarr>=3'")
    try:
        return zarr.open(name, mode="r")
    except MemoryError:
        raise
    except Exception as error:  # the library has many, and stores have theirs
        raise InputError(f"{name} cannot be read as Zarr: {_stored.first_line(error)}") from error


def _member(group: Any, path: str, what: str) -> Any:
    try:
        array = group[path]
    except Exception as error:
        raise InputError(f"{what} is missing or damaged, which the image names: {_stored.first_line(error)}") from error
    if not hasattr(array, "shape"):
        raise InputError(f"{what} is a group; the image names it as an array")
    return array


def _members(group: Any) -> str:
    return ", ".join(sorted(group.keys())) or "it is empty"


def _values(array: Any, picked: Any, what: str) -> np.ndarray[Any, Any]:
    """Values in memory of their own, in this machine's order of bytes, the last axis fastest."""
    kind = _stored.native_type(array.dtype, what)
    try:
        return np.ascontiguousarray(array[picked], dtype=kind)
    except MemoryError:
        raise
    except Exception as error:  # each codec has its own
        raise InputError(f"{what} has a chunk that is damaged: {_stored.first_line(error)}") from error


def _missing_chunks(array: Any, folder: str) -> list[str]:
    """A remark, where files of chunks are not there. They are counted here: zarr 2 counts no nested ones."""
    if not os.path.isdir(folder):
        return []
    step = getattr(array, "shards", None) or array.chunks
    expected = math.prod(-(-length // each) for length, each in zip(array.shape, step))
    found = sum(
        not name.startswith(".") and name != "zarr.json" for _, _, names in os.walk(folder) for name in names
    )
    if found >= expected:
        return []
    missing = expected - found
    return [f"{missing} of {expected} chunks of {folder} are missing: their voxels are {array.fill_value}"]


def write(
    volume: Any,
    path: PathLike,
    *,
    space: str = "LPS",
    chunks: Sequence[int] = (64, 128, 128),
    levels: int = 1,
    version: str = "0.5",
    overwrite: bool = False,
) -> None:
    """Writes a volume as OME-Zarr, which appears under its name only when it is complete.

    Parameters
    ----------
    volume : Volume, or an image of SimpleITK, itk, nibabel, MONAI or TorchIO
        With one value a voxel, in host memory.
    path : str or path
        The folder that is made, such as "ct.ome.zarr".
    space : "LPS" or "RAS"
        Frame of x, y and z in the file. The file does not say it: it is to be read with the same word.
    chunks : (int, int, int)
        Voxels of a chunk along k, j, i.
    levels : int
        Resolutions. Each holds every second voxel of the one before along each axis, so that labels stay labels, and no
        voxel moves.
    version : "0.5" or "0.4"
        Of OME-Zarr. 0.5 lies in Zarr 3, which needs zarr 3; 0.4 lies in Zarr 2.
    overwrite : bool
        Whether a folder of Zarr that exists is replaced.

    Raises
    ------
    InputError
        For a direction that the file cannot say, several values a voxel, and types of voxels that Tetwarp has not.
    Error
        For something that exists, a full disk, a folder that is missing.
    ModuleNotFoundError
        Without zarr.

    Examples
    --------
    >>> import tempfile, os
    >>> import tetwarp as tw
    >>> path = os.path.join(tempfile.mkdtemp(), "ct.ome.zarr")
    >>> write(tw.phantom((32, 32, 16)), path, levels=2, version="0.4")
    >>> read(path, level=1, space="LPS").geometry.spacing
    (1.6, 1.6, 2.0)
    """
    given, _ = adapters.volume_of(volume)
    with _zarr_files.written(_path(path), given, given.geometry, space, chunks, levels, version, overwrite) as image:
        for first, last in image.slabs():
            image.put(first, given.array[first:last])


def deform(
    source: Any,
    destination: PathLike,
    field: VertexField | None = None,
    *,
    pull_field: PullField | None = None,
    grid: Any = "same",
    interpolation: str = "linear",
    background: float | None = None,
    outside: str = "refuse",
    level: int = 0,
    index: Mapping[str, int] | None = None,
    space: str | None = None,
    unit: str | None = None,
    geometry: Geometry | None = None,
    order: str = "kji",
    chunks: Sequence[int] = (64, 128, 128),
    levels: int = 1,
    version: str = "0.5",
    overwrite: bool = False,
    backend: str = "auto",
    device: int = 0,
    threads: int = 0,
    memory: int | str | None = None,
    progress: _calls.Progress = False,
) -> Report:
    """Deforms a volume into OME-Zarr, with the bits of `tetwarp.deform`, and without the whole result in memory.

    The source is read once, whole. The result is made and written in slabs of whole chunks along k; only its addresses
    are reserved for all of it.

    Parameters
    ----------
    source : str or path, or what `tetwarp.deform` takes
        A path is read by `read`, with `level`, `index`, `space`, `unit`, `geometry` and `order`.
    destination : str or path
        Written as by `write`, with `chunks`, `levels`, `version` and `overwrite`; in the frame `space`, else LPS.
    field, pull_field, grid, interpolation, background, outside, backend, device, threads, memory, progress
        As for `tetwarp.deform`.

    Returns
    -------
    Report

    Raises
    ------
    InputError, Error, ModuleNotFoundError
        As `read`, `write` and `tetwarp.deform` do. Nothing is left behind then.

    Examples
    --------
    >>> import tempfile, os
    >>> import tetwarp as tw
    >>> ct = tw.phantom((32, 32, 16), spacing=(10, 10, 15))
    >>> field = tw.fields.wave(ct.geometry, amplitude=8, wavelength=200, cell_size=4)
    >>> path = os.path.join(tempfile.mkdtemp(), "waved.ome.zarr")
    >>> report = deform(ct, path, field, outside="background", version="0.4")
    >>> whole = tw.deform(ct, field, outside="background")
    >>> read(path, space="LPS").array.tobytes() == whole.volume.array.tobytes(), report == whole.report
    (True, True)
    """
    if (field is None) == (pull_field is None):
        raise TypeError("pass either a forward field, or pull_field=")
    used: VertexField | PullField
    if field is not None:
        used = require_forward(field, "pass it as pull_field=")
    else:
        used = require_pull(pull_field, "pass it as the third argument")
    name, copies = _path(destination), 0
    if isinstance(source, (str, os.PathLike)):
        given = read(source, level=level, index=index, space=space, unit=unit, geometry=geometry, order=order)
    else:
        given, back = adapters.volume_of(source)
        copies = 1 if adapters.copies_of(back) else 0  # there is no way back
    output = _grid_of(grid, given, field, outside)
    # As in tetwarp.deform: what grid="fit" adds lies beyond the lattice.
    beyond = "background" if isinstance(grid, str) and grid == "fit" and outside == "refuse" else outside
    shown = _calls.shown(progress, "deform")
    total = None
    with _zarr_files.written(name, given, output, space or "LPS", chunks, levels, version, overwrite) as image:
        warp = _resampler_of(
            used, output, outside=beyond, backend=backend, device=device, threads=threads, memory=memory
        )
        target = Target(given, interpolation, background)
        for first, last in image.slabs():
            # A slab is a region of the whole grid: on a grid of its own, vertices might be rounded to other places. The
            # system gives memory to the pages of an array that are written, which are those of the slab.
            target.out = np.empty(output.shape, given.array.dtype)
            _, _, report = warp.resample(
                [target],
                region=((0, 0, first), (output.size[0], output.size[1], last)),
                progress=_share(shown, first / output.size[2], last / output.size[2]),
            )
            image.put(first, target.out[first:last])
            total = report if total is None else _sum_of(total, report)
    assert total is not None
    total.copies = copies
    total.notes += _notes_of(grid, output, given)
    return total


def _share(shown: Any, first: float, last: float) -> _calls.Progress:
    """Progress of one slab, as a part of all."""
    return False if shown is None else lambda share: shown(first + (last - first) * share)


def _sum_of(one: Report, other: Report) -> Report:
    """The report of two regions of one output; what it says of the field is the same in both."""
    for name in ("covered", "uncovered", "clamped", "padded", "conflicts"):
        setattr(one, name, getattr(one, name) + getattr(other, name))
    return one
