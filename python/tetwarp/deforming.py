# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Deforming in one call, and what else a field is good for."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _arrays, _calls, _core, adapters
from .errors import InputError
from .field import PullField, VertexField, require_forward, require_pull
from .geometry import Geometry
from .report import Report
from .resampler import PullResampler, Resampler, Target, names_of_maps
from .volume import Volume


@dataclasses.dataclass
class Along:
    """A volume that goes along with another one through its field, from its own grid onto the output's.

    Parameters
    ----------
    volume : Volume, or an image of SimpleITK, itk, nibabel, MONAI or TorchIO
    interpolation : "linear", "nearest", "cubic" or "vote", optional
        By default that of the call; labels want "vote".
    background : float, optional
        By default the smallest value.
    own : bool
        Back onto its own grid instead of the output's.
    out : array, optional
        Takes the result.
    """

    volume: Any
    interpolation: str | None = None
    background: float | None = None
    own: bool = False
    out: Any = None


@dataclasses.dataclass
class Deformed:
    """What `deform` gives."""

    #: The deformed volume, of the type of what was given.
    volume: Any
    #: Maps by name, each a `Volume` on the output's grid.
    maps: dict[str, Volume]
    #: What happened.
    report: Report
    #: What went along, in its order, each of the type of what was given.
    volumes: list[Any]
    #: Moved points, (n, 3), LPS mm; None without points.
    points: npt.NDArray[np.float64] | None = None
    #: For each point whether the field holds it.
    inside: npt.NDArray[np.bool_] | None = None


def _grid_of(grid: Any, volume: Volume, field: VertexField | None, outside: str) -> Geometry:
    if isinstance(grid, Geometry):
        return grid
    if isinstance(grid, str):
        if grid == "same":
            return volume.geometry.straightened()
        if grid == "fit":
            if field is None:
                raise InputError(
                    "grid=\"fit\" needs to know where vertices go, which a pull field does not say; pass a Geometry"
                )
            return Geometry._of(_core.fitting_grid(volume.geometry._grid, field._host(), outside))
        raise InputError(f'grid is {grid!r}; expected "same", "fit", a Geometry or a volume')
    return adapters.volume_of(grid, name="grid")[0].geometry.straightened()


def _notes_of(grid: Any, output: Geometry, volume: Volume) -> list[str]:
    """Remarks about a volume, and the grid onto which it was resampled."""
    notes = list(volume.notes)
    if isinstance(grid, str) and grid == "same" and output != volume.geometry:
        notes.insert(
            0,
            f"the volume's slices lean or lie at uneven distances: the output has a straight, even grid of "
            f"{' x '.join(map(str, output.size))} voxels, so that the identity resamples too",
        )
    return notes


def deform(
    volume: Any,
    field: VertexField | None = None,
    *,
    pull_field: PullField | None = None,
    grid: Any = "same",
    interpolation: str = "linear",
    background: float | None = None,
    outside: str = "refuse",
    maps: Sequence[str] | Mapping[str, Any] = (),
    with_: Sequence[Any] = (),
    points: npt.ArrayLike | None = None,
    preserve: str | None = None,
    out: Any = None,
    backend: str = "auto",
    device: int = 0,
    threads: int = 0,
    memory: int | str | None = None,
    stream: Any = None,
    progress: _calls.Progress = False,
) -> Deformed:
    """Deforms a volume by a field.

    Parameters
    ----------
    volume : Volume, or an image of SimpleITK, itk, nibabel, MONAI or TorchIO
    field : VertexField
        Forward field: where each vertex goes.
    pull_field : PullField
        Instead: a field that leads from the output back to the input.
    grid : "same", "fit", Geometry or a volume
        Grid of the output: that of the volume, straightened if it is tilted or uneven; that, grown to hold the deformed
        lattice; or this one.
    interpolation : "linear", "nearest", "cubic" or "vote"
    background : float, optional
        Value where nothing maps; by default that of a DICOM series, else the smallest value.
    outside : "refuse", "rest" or "background"
        What becomes of voxels that the field does not reach.
    maps : names, or a dict of names and arrays that take them
        "coverage", "inverse", "jacobian", "folds"; see `Resampler.resample`.
    with_ : sequence of Along or of volumes
        What goes through the same field.
    points : array_like, (n, 3), optional
        Landmarks, LPS mm, moved forward.
    preserve : "mass", optional
        HU of tissue that is squeezed grow, so that mass is kept.
    out : array, optional
        Takes the result.
    backend, device, threads, memory, stream
        As for `Resampler`.
    progress : bool or callable
        True: a bar, where tqdm is installed. A callable gets the share that is done, 0 to 1.

    Returns
    -------
    Deformed

    Raises
    ------
    InputError
        For a field that does not reach over the output, and arrays that do not fit.
    TypeError
        For a pull field in the place of a forward one.

    Examples
    --------
    >>> import tetwarp as tw
    >>> ct = tw.phantom((32, 32, 16), spacing=(10, 10, 15))
    >>> field = tw.fields.wave(ct.geometry, amplitude=8, wavelength=200, cell_size=4)
    >>> done = tw.deform(ct, field, outside="background", maps=("coverage", "jacobian"))
    >>> done.volume.array.shape, done.report.inverted
    ((16, 32, 32), 0)
    """
    given, back = adapters.volume_of(volume)
    if (field is None) == (pull_field is None):
        raise TypeError("pass either a forward field, or pull_field=")
    if field is not None:
        field = require_forward(field, "pass it as pull_field=")
    else:
        pull_field = require_pull(pull_field, "pass it as the second argument")
    _calls.word(preserve, "preserve", ("mass",), optional=True)
    if field is None and (points is not None or preserve):
        raise InputError("points and preserve need a forward map, which a pull field has not")
    output = _grid_of(grid, given, field, outside)
    # What grid="fit" adds lies beyond the lattice; that this reaches over the volume is known.
    beyond = "background" if isinstance(grid, str) and grid == "fit" and outside == "refuse" else outside
    main = Target(given, interpolation, background, out)
    along = [one if isinstance(one, Along) else Along(one) for one in with_]
    copies = adapters.copies_of(back)
    others: list[tuple[Along, Target, Any]] = []
    for number, one in enumerate(along):
        other, way_back = adapters.volume_of(one.volume, name=f"volume {number + 1} of with_")
        copies += adapters.copies_of(way_back)
        others.append((one, Target(other, one.interpolation or interpolation, one.background, one.out), way_back))

    used = require_pull(pull_field, "") if field is None else field
    kinds = {"backend": backend, "device": device, "threads": threads, "memory": memory}
    onto_output = _resampler_of(used, output, outside=beyond, stream=stream, **kinds)
    targets = [main] + [target for one, target, _ in others if not one.own]
    wanted = dict(maps) if isinstance(maps, Mapping) else {name: None for name in names_of_maps(maps)}
    if preserve:
        targets[0] = _in_real_numbers(main)
        wanted.setdefault("coverage", None)
        wanted.setdefault("jacobian", None)
    volumes, made, report = onto_output.resample(targets, maps=wanted, stream=stream, progress=progress)
    if preserve:
        volumes[0], clamped = _with_mass(main, volumes[0], made, out)
        report.clamped += clamped
        made = {name: made[name] for name in maps}
    has_series = any(target.volume.series is not None for target in [main, *(target for _, target, _ in others)])
    origin = _origin_of(used, threads) if has_series else None
    results = iter(volumes[1:])
    gone_along = []
    for one, target, way_back in others:
        if one.own:
            own_grid = target.volume.geometry.straightened()
            own = _resampler_of(used, own_grid, outside=outside, stream=stream, **kinds)
            other = own.resample([target], stream=stream)[0][0]
        else:
            other = next(results)
        if target.volume.series is not None:
            other.derivation = _derivation(origin, target, outside, None)
        gone_along.append(way_back(other))
    result = volumes[0]
    if given.series is not None:
        result.derivation = _derivation(origin, main, outside, preserve)
    report.copies = copies
    report.notes += _notes_of(grid, output, given)
    done = Deformed(back(result), made, report, gone_along)
    if points is not None and field is not None:
        done.points, done.inside = move_points(points, field, output, outside=beyond, threads=threads)
    return done


def _in_real_numbers(main: Target) -> Target:
    """The volume in a real type that holds its values, so that masses are rounded once."""
    if not isinstance(main.volume.array, np.ndarray):
        raise InputError("preserve=\"mass\" takes a volume in host memory")
    kind = _core.type_of_mass(main.volume.array, main.volume.geometry._grid)
    real = Volume(main.volume.array.astype(kind), main.volume.geometry, padding=main.volume.padding)
    return Target(real, main.interpolation, main.background)


def _with_mass(main: Target, hu: Volume, maps: dict[str, Volume], out: Any) -> tuple[Volume, int]:
    array = np.empty(hu.array.shape, main.volume.array.dtype) if out is None else out
    clamped = _core.preserve_mass(
        hu.array, maps["coverage"].array, maps["jacobian"].array, array, hu.geometry._grid, main.volume.padding
    )
    result = Volume(array, hu.geometry, padding=main.volume.padding)
    result.background = main.background
    result.series = main.volume.series
    return result, clamped


def _resampler_of(
    field: VertexField | PullField, geometry: Geometry, *, outside: str, stream: Any = None, **kinds: Any
) -> Resampler | PullResampler:
    """A resampler onto a grid with the field set."""
    if isinstance(field, VertexField):
        forward = Resampler(geometry, **kinds)
        forward.set_field(field, outside=outside, stream=stream)
        return forward
    pull = PullResampler(geometry, **kinds)
    pull.set_field(field, outside=outside, stream=stream)
    return pull


@dataclasses.dataclass
class _Origin:
    """What a DICOM series says of the field that it was made by."""

    sha256: str
    direction: str
    what: str
    moves: bool


def _origin_of(field: VertexField | PullField, threads: int) -> _Origin | None:
    """That of a field; None where its values lie on a device."""
    displacement = _arrays.on_host(field.displacement)
    if displacement is not None and not isinstance(displacement, np.ndarray):
        return None
    number = _calls.threads(threads)
    if isinstance(field, PullField):
        sha256 = _core.hash_pull_field(field.geometry._grid, np.asarray(displacement), number)
        return _Origin(sha256, "pull", "Deformed by a pull field", True)
    moves = field.mesh is not None or bool(np.any(displacement))
    what = "Deformed by a field of vertices" if moves else "Resampled by the identity"
    return _Origin(_core.hash_field(field._host(), number), "forward", what, moves)


def _derivation(origin: _Origin | None, main: Target, outside: str, preserve: str | None) -> Mapping[str, Any] | None:
    """What a DICOM series says of how it was made, as the program writes it."""
    if origin is None:
        return None
    background = f"{main.background:.1f}" if main.background == int(main.background) else repr(main.background)
    parameters = (
        f"interpolation={main.interpolation} outside={outside} background={background} direction={origin.direction}"
        + (" preserve=mass" if preserve else "")
    )
    return {
        "field_sha256": origin.sha256,
        "parameters": parameters,
        "description": f"{origin.what}, {main.interpolation} interpolation",
        "deformed": origin.moves,
    }


def invert(
    field: VertexField,
    geometry: Geometry,
    *,
    outside: str = "background",
    backend: str = "auto",
    device: int = 0,
    threads: int = 0,
    progress: _calls.Progress = False,
) -> PullField:
    """The exact inverse of a forward field, at the voxel centres of a grid.

    It is the inverse of the piecewise affine map, not an approximation; NaN where nothing maps. ITK, MONAI and others
    take it as their displacement field.

    Parameters
    ----------
    field : VertexField
    geometry : Geometry
        Grid of the result.

    Examples
    --------
    >>> grid = Geometry((8, 8, 8))
    >>> import tetwarp as tw
    >>> inverse = invert(tw.fields.translate(grid, by=(1, 0, 0)), grid)
    >>> inverse.displacement[4, 4, 4]
    array([-1.,  0.,  0.], dtype=float32)
    """
    field = require_forward(field, "its inverse is a forward field; make one with tetwarp.forward_of")
    warp = Resampler(geometry, backend=backend, device=device, threads=threads)
    warp.set_field(field, outside=outside, jacobian_range=False)
    maps = warp.resample([], maps=("inverse",), progress=progress)[1]
    return PullField(geometry, maps["inverse"].array)


def forward_of(field: PullField, geometry: Geometry) -> VertexField:
    """The forward field that does the work of a pull field in reverse, for `invert`.

    Each sample goes to where the pull field takes its voxel from; the lattice grows until its image holds `geometry`.

    Examples
    --------
    >>> grid = Geometry((4, 4, 4))
    >>> still = forward_of(PullField(grid, np.zeros((4, 4, 4, 3), np.float32)), grid)
    >>> bool(still.displacement.any())
    False
    """
    field = require_pull(field, "it is a forward field already")
    return VertexField._of(_core.continued(field.geometry._grid, field.displacement, geometry._grid))


def jacobian(
    field: VertexField,
    geometry: Geometry,
    *,
    outside: str = "background",
    backend: str = "auto",
    device: int = 0,
    threads: int = 0,
) -> Volume:
    """Jacobian determinant of the forward map at each voxel of the deformed volume; NaN where nothing maps.

    Examples
    --------
    >>> import tetwarp as tw
    >>> grid = Geometry((8, 8, 8))
    >>> float(jacobian(tw.fields.identity(grid), grid).array.min())
    1.0
    """
    field = require_forward(field, "the determinant is that of a forward map")
    warp = _resampler_of(field, geometry, outside=outside, backend=backend, device=device, threads=threads)
    return warp.resample([], maps=("jacobian",))[1]["jacobian"]


def compose(*fields: VertexField, threads: int = 0) -> VertexField:
    """One field of several, the first applied first: its lattice is that of the first.

    Examples
    --------
    >>> import tetwarp as tw
    >>> grid = Geometry((9, 9, 9))
    >>> there, back = tw.fields.translate(grid, by=(0, 0, 0)), tw.fields.identity(grid)
    >>> compose(there, back).lattice == there.lattice
    True
    """
    forward = [require_forward(field, "only forward fields compose") for field in fields]
    if not forward:
        raise InputError("there is no field to compose; pass at least one")
    hosts = [field._host() for field in forward]
    return VertexField._of(_core.compose(hosts, _calls.threads(threads), _calls.options(False, "field")))


def move_points(
    points: npt.ArrayLike,
    field: VertexField,
    geometry: Geometry,
    *,
    outside: str = "background",
    threads: int = 0,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """Moves landmarks by the forward map: what the volume shows at a point before, the output shows where it comes to lie.

    Parameters
    ----------
    points : array_like, (n, 3)
        LPS mm.
    geometry : Geometry
        Grid of the output, which decides how vertices are rounded (2^-12 voxel).

    Returns
    -------
    points : (n, 3) float64
    inside : (n,) bool
        Whether the field holds the point; others stay where they are.

    Examples
    --------
    >>> import tetwarp as tw
    >>> grid = Geometry((9, 9, 9))
    >>> move_points([[4, 4, 4]], tw.fields.translate(grid, by=(0, 0, 2)), grid)[0]
    array([[4., 4., 6.]])
    """
    field = require_forward(field, "points are moved by a forward map; a pull field has none")
    places = _arrays.numbers(points, np.float64, "points")
    if places.ndim != 2 or places.shape[1] != 3:
        raise InputError(f"points have the shape {places.shape}; expected (n, 3)")
    moved, inside = _core.move_points(
        geometry._grid, field._host(), places, outside, _calls.threads(threads), _calls.options(False, "points")
    )
    return moved, inside.astype(bool)
