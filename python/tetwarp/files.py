# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Files in and out."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from typing import Any, Union

from . import _calls, _core, adapters
from .errors import InputError
from .field import PullField, VertexField
from .geometry import Geometry
from .volume import Volume

PathLike = Union[str, "os.PathLike[str]"]


def _path(path: PathLike) -> str:
    text = os.fspath(path)
    if not isinstance(text, str) or "\0" in text:
        raise InputError(f"the path is {path!r}; expected a text without NUL")
    return text


def read(
    path: PathLike,
    *,
    series: str | int = "",
    single: bool = False,
    uneven: str | None = None,
    nifti_frame: str = "sform",
    threads: int = 0,
    progress: _calls.Progress = False,
) -> Volume:
    """Reads a volume: a folder of DICOM files, one DICOM file (its series is found beside it), .nii, .nii.gz, .nrrd, .mha.

    Parameters
    ----------
    path : str or path
    series : str or int
        UID of a DICOM series, or the number that `info` says, where a folder holds several.
    single : bool
        Read the one DICOM file alone.
    uneven : "exact", optional
        Takes slices at uneven distances, each where it is; without it such a series is refused.
    nifti_frame : "sform" or "qform"
        Which place of a NIfTI file counts.

    Returns
    -------
    Volume
        CT is int16 in HU.

    Raises
    ------
    InputError
        For what cannot be read, is damaged, or is several series.

    Examples
    --------
    >>> import tempfile, os
    >>> import tetwarp as tw
    >>> path = os.path.join(tempfile.mkdtemp(), "ct.nii.gz")
    >>> tw.write(tw.phantom((8, 8, 4)), path)
    >>> tw.read(path).geometry.size
    (8, 8, 4)
    """
    _calls.word(uneven, "uneven", ("exact",), optional=True)
    array, grid, background, padding, notes, headers = _core.read(
        _path(path),
        str(series),
        bool(single),
        uneven == "exact",
        nifti_frame,
        _calls.threads(threads),
        _calls.options(progress, "read"),
    )
    volume = Volume(array, Geometry._of(grid), padding=padding)
    volume.background = background
    volume.notes = notes
    volume.series = headers
    return volume


def write(
    volume: Any,
    path: PathLike,
    *,
    like: Volume | None = None,
    compress: int | None = None,
    keep_frame_of_reference: bool = False,
    series_number: int | None = None,
    series_description: str | None = None,
    overwrite: bool = False,
    threads: int = 0,
    progress: _calls.Progress = False,
) -> None:
    """Writes a volume: .nii, .nii.gz, .nrrd, .mha, or a folder that receives a derived DICOM series.

    A file appears under its name only when it is complete. A series has new UIDs: those of the source's patient and
    study, a new series and, if it is deformed, a new frame of reference.

    Parameters
    ----------
    volume : Volume, or an image of SimpleITK, itk, nibabel, MONAI or TorchIO
        For a series: of int16, in HU.
    like : Volume, optional
        For a series: what was read from the source series; by default what the volume came from.
    compress : int, optional
        Level 1 to 9, or 0.
    overwrite : bool
        Whether something that exists is replaced; a folder only if Tetwarp wrote all of it.

    Raises
    ------
    InputError
        For a volume that the format cannot hold.
    Error
        For something that exists, a full disk, a folder that is missing.

    Examples
    --------
    >>> import tempfile, os
    >>> import tetwarp as tw
    >>> tw.write(tw.phantom((8, 8, 4)), os.path.join(tempfile.mkdtemp(), "ct.mha"))
    """
    given, _ = adapters.volume_of(volume)
    name = _path(path)
    options = _calls.options(progress, "write")
    if _core.has_image_suffix(name):
        level = -1 if compress is None else _calls.whole(compress, "compress", 0, 9)
        metadata = {}
        if given.derivation is not None:
            metadata["descrip"] = "tetwarp field " + str(given.derivation["field_sha256"])[:16]
        _core.write_file(name, given.array, given.geometry._grid, level, metadata, bool(overwrite), options)
        return
    if os.path.splitext(name.rstrip("/"))[1] and not name.endswith("/"):
        raise InputError(
            f'unknown suffix of "{name}"; expected .nii .nii.gz .nrrd .mha, or the name of a folder, ending in /'
        )
    headers = given.series if like is None else like.series
    if headers is None:
        raise InputError(
            f"a DICOM series can only be derived from DICOM, {name}; pass like= what was read from the source series"
        )
    how = given.derivation
    if how is None:
        raise InputError(
            "it is not known how this volume was made, which a derived series says; write what tetwarp.deform gave"
        )
    background = given.background if given.background is not None else -1024.0
    _core.write_series(
        name.rstrip("/"),
        given.array,
        given.geometry._grid,
        headers,
        {key: str(how[key]) for key in ("field_sha256", "parameters", "description")},
        background,
        bool(how["deformed"]),
        bool(keep_frame_of_reference),
        series_number,
        series_description,
        _calls.threads(threads),
        bool(overwrite),
        options,
    )


def info(path: PathLike, *, single: bool = False, nifti_frame: str = "sform") -> dict[str, Any]:
    """What a file or folder holds, as `tetwarp info --json` says it.

    Examples
    --------
    >>> import tempfile, os
    >>> import tetwarp as tw
    >>> path = os.path.join(tempfile.mkdtemp(), "ct.mha")
    >>> tw.write(tw.phantom((8, 8, 4)), path)
    >>> info(path)["kind"]
    'volume'
    """
    document: dict[str, Any] = json.loads(_core.info(_path(path), bool(single), nifti_frame))
    return document


def read_field(
    path: PathLike | Sequence[PathLike],
    *,
    like: Any = None,
    direction: str = "forward",
    cell_size: int | None = None,
    nifti_frame: str = "sform",
    threads: int = 0,
) -> VertexField | PullField:
    """Reads a field file: a lattice, a mesh, or a transform. Of several files the fields are composed.

    Parameters
    ----------
    path : str or path, or a list of these
        Options stand behind the name, as on the command line: `"field.npy:order=zyx"`. Points go through the first of
        several, and from there on: `["1Warp.nii.gz", "0GenericAffine.mat"]` as after `antsApplyTransforms -t`. Beyond
        the grid of a first field none of them is applied, so do not resample with `outside="rest"` there.
    like : Volume, image or Geometry, optional
        The volume that the field is for; of a pull field the output grid, on which a transform is sampled and an array
        lies. Transforms, files without a grid of their own, and several files need it.
    direction : "forward" or "pull"
        "pull": the file leads from the output back to the input. A file that says otherwise is refused.
    cell_size : int, optional
        Of a transform: a vertex on every `cell_size`-th voxel.
    nifti_frame : "sform" or "qform"
        Which place of a NIfTI file counts.

    Returns
    -------
    VertexField or PullField

    Raises
    ------
    InputError
        For a file that is no field, that says the other direction, or that has a value which is not finite.

    Examples
    --------
    >>> import tempfile, os
    >>> import tetwarp as tw
    >>> path = os.path.join(tempfile.mkdtemp(), "field.mha")
    >>> tw.write_field(tw.fields.identity(Geometry((4, 4, 4))), path)
    >>> tw.read_field(path).lattice.size
    (4, 4, 4)
    """
    _calls.word(direction, "direction", ("forward", "pull"))
    one = isinstance(path, (str, os.PathLike))
    names: list[Any] = [path] if isinstance(path, (str, os.PathLike)) else list(path)
    if not names or not all(isinstance(name, (str, os.PathLike)) and os.fspath(name) for name in names):
        raise TypeError(f"path is {path!r}; expected a name, or a list of names")
    texts = [_path(name) for name in names]
    number = _calls.threads(threads)
    if like is None:
        if not one:
            raise TypeError("like is missing; several files need the volume that the field is for")
        text = texts[0]
        if direction == "pull":
            grid, displacement = _core.read_pull_file(text, nifti_frame)
            return PullField(Geometry._of(grid), displacement)
        return VertexField._of(_core.read_file(text, nifti_frame))
    geometry = like if isinstance(like, Geometry) else adapters.volume_of(like, name="like")[0].geometry
    options = _calls.options(False, "field")
    if direction == "pull":
        grid, displacement, notes = _core.read_pull(texts, geometry._grid, nifti_frame, number, options)
        field = PullField(Geometry._of(grid), displacement)
        field.notes = notes
        return field
    size = None if cell_size is None else _calls.whole(cell_size, "cell_size", 1, 65536)
    parts, notes = _core.read_forward(texts, geometry._grid, size, nifti_frame, number, options)
    return VertexField._of(parts, notes)


def write_field(
    field: VertexField | PullField, path: PathLike, *, overwrite: bool = False, progress: _calls.Progress = False
) -> None:
    """Writes a field, which says its direction: .mha, .nrrd, .nii, .nii.gz, or a mesh as .vtk, .vtu.

    Raises
    ------
    InputError
        For a field that the format cannot hold.
    Error
        For something that exists, a full disk, a folder that is missing.

    Examples
    --------
    >>> import tempfile, os
    >>> import tetwarp as tw
    >>> tw.write_field(tw.fields.identity(Geometry((4, 4, 4))), os.path.join(tempfile.mkdtemp(), "field.nii.gz"))
    """
    name = _path(path)
    options = _calls.options(progress, "write")
    if isinstance(field, VertexField):
        _core.write_forward(name, field._host(), bool(overwrite), options)
    elif isinstance(field, PullField):
        _core.write_pull(name, field.geometry._grid, field.displacement, bool(overwrite), options)
    else:
        raise TypeError(f"the field is a {type(field).__name__}; expected a VertexField or a PullField")


#: Labels of the phantom by their names.
PHANTOM_LABELS = {name: value for value, name in enumerate(_core.phantom_labels())}


def phantom(
    size: Sequence[int] = (512, 512, 300),
    *,
    spacing: Sequence[float] = (0.8, 0.8, 1.0),
    seed: int = 1,
    noise_hu: float = 12.0,
) -> Volume:
    """A plausible CT of a trunk that never was, int16 in HU: the same bits on every machine.

    Parameters
    ----------
    size : (int, int, int)
        Voxels along i, j, k.
    spacing : (float, float, float)
        mm along i, j, k; the body fills the field of view.
    seed : int
        Decides the noise and small variations of the anatomy.
    noise_hu : float
        Standard deviation of the noise, HU.

    Examples
    --------
    >>> phantom((16, 16, 8)).array.dtype
    dtype('int16')
    """
    return _phantom(size, spacing, seed, noise_hu, False)[0]


def labelled_phantom(
    size: Sequence[int] = (512, 512, 300),
    *,
    spacing: Sequence[float] = (0.8, 0.8, 1.0),
    seed: int = 1,
    noise_hu: float = 12.0,
) -> tuple[Volume, Volume]:
    """The phantom, and what each of its voxels belongs to: uint8, values of `PHANTOM_LABELS`.

    Examples
    --------
    >>> ct, labels = labelled_phantom((32, 32, 16), spacing=(12, 12, 18))
    >>> bool((labels.array == PHANTOM_LABELS["lung"]).any())
    True
    """
    ct, labels = _phantom(size, spacing, seed, noise_hu, True)
    assert labels is not None
    return ct, labels


def _phantom(
    size: Sequence[int], spacing: Sequence[float], seed: int, noise_hu: float, labels: bool
) -> tuple[Volume, Volume | None]:
    grid = Geometry(size, spacing)
    array, made, label_array = _core.phantom(
        list(grid.size),
        list(grid.spacing),
        _calls.whole(seed, "seed", 0, 2**64 - 1),
        _calls.number(noise_hu, "noise_hu"),
        labels,
        _calls.options(False, "phantom"),
    )
    volume = Volume(array, Geometry._of(made))
    volume.background = -1024.0
    if not labels:
        return volume, None
    labelled = Volume(label_array, Geometry._of(made))
    labelled.background = 0.0
    return volume, labelled
