# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What OME-Zarr (NGFF 0.4 and 0.5) says of a place, as dicts of JSON; no file is touched.

The specification: https://ngff.openmicroscopy.org/0.5/. It knows a scale and a translation along each axis, but no
direction, and not whether x grows to the patient's left or right.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .errors import InputError
from .geometry import Geometry

#: Units of length: mm are a number times the first, over the second, so that they are rounded once.
UNITS = {
    "nanometer": (1, 10**6),
    "micrometer": (1, 1000),
    "millimeter": (1, 1),
    "centimeter": (10, 1),
    "meter": (1000, 1),
}

#: Where x, y and z grow, in the words that an axis may have for it (RFC 4 of NGFF).
_GROWS = {
    "LPS": {"x": "right-to-left", "y": "anterior-to-posterior", "z": "inferior-to-superior"},
    "RAS": {"x": "left-to-right", "y": "posterior-to-anterior", "z": "inferior-to-superior"},
}

#: How far a voxel that is written may lie from where it is read, mm: the rounding of direction cosines.
_SAME_PLACE_MM = 1e-6


@dataclasses.dataclass(frozen=True)
class Axis:
    """One axis of the array: its name, its type such as "space" (or an empty text), its unit, where it grows."""

    name: str
    kind: str
    unit: str | None = None
    grows: str | None = None


@dataclasses.dataclass(frozen=True)
class Level:
    """One resolution: the path of its array in the group; of each axis the scale, and where sample 0 lies."""

    path: str
    scale: tuple[float, ...]
    translation: tuple[float, ...]


@dataclasses.dataclass(frozen=True)
class Multiscale:
    """One image at several resolutions, the finest first."""

    axes: tuple[Axis, ...]
    levels: tuple[Level, ...]


def _entry(of: Any, key: str, kind: type | tuple[type, ...], what: str) -> Any:
    value = of.get(key) if isinstance(of, Mapping) else None
    if not isinstance(value, kind):
        raise InputError(f"{what} is no OME-Zarr 0.4 or 0.5: {key!r} is missing or malformed")
    return value


def multiscale_of(attributes: Mapping[str, Any], what: str) -> Multiscale:
    """The image that the attributes of a group describe.

    Raises
    ------
    InputError
        For another version, several images, and what contradicts the specification.
    """
    inner = attributes.get("ome", attributes)
    images = _entry(inner, "multiscales", list, what)
    if len(images) != 1:
        raise InputError(f"{what} has {len(images)} images; read the array of one by its own path, with geometry=")
    if "ome" in attributes:
        said, wanted = inner.get("version"), "0.5"
    else:  # 0.4 recommends to say it, and no more
        said, wanted = _entry(images[0], "version", (str, type(None)), what) or "0.4", "0.4"
    if said != wanted:
        raise InputError(f"{what} is OME-Zarr {said}; expected 0.4 or 0.5: read its array by its path and geometry=")
    axes = tuple(_axis_of(one, what) for one in _entry(images[0], "axes", list, what))
    names = [axis.name for axis in axes]
    if len(set(names)) != len(names):
        raise InputError(f"{what} is no OME-Zarr: two axes have one name, {', '.join(names)}")
    spatial = [axis.name for axis in axes if axis.kind == "space"]
    if sorted(spatial) != ["x", "y", "z"]:
        raise InputError(
            f"{what} has the axes of space {', '.join(spatial) or 'none'}; expected x, y and z: read its array by its "
            "own path, with geometry="
        )
    of_all = images[0].get("coordinateTransformations") or []
    levels = []
    for one in _entry(images[0], "datasets", list, what):
        own = _entry(one, "coordinateTransformations", list, what)
        if sum(_entry(each, "type", str, what) == "scale" for each in own) != 1:
            raise InputError(f"{what} is no OME-Zarr: a level has not one scale")
        levels.append(Level(_entry(one, "path", str, what), *_folded([*own, *of_all], len(axes), what)))
    if not levels:
        raise InputError(f"{what} is no OME-Zarr: it has no level")
    return Multiscale(axes, tuple(levels))


def _axis_of(one: Any, what: str) -> Axis:
    kind, unit, grows = (one.get(key) if isinstance(one, Mapping) else None for key in ("type", "unit", "orientation"))
    if grows is not None:
        grows = _entry(grows, "value", str, what)
    return Axis(_entry(one, "name", str, what), str(kind or ""), None if unit is None else str(unit), grows)


def _folded(steps: Sequence[Any], axes: int, what: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Scale and translation of steps that follow one another."""
    scale, translation = np.ones(axes), np.zeros(axes)
    for step in steps:
        kind = _entry(step, "type", str, what)
        if kind == "identity":
            continue
        if kind not in ("scale", "translation"):
            raise InputError(f'{what} has a transformation "{kind}"; expected scale and translation')
        numbers = _entry(step, kind, list, what)
        if len(numbers) != axes or not all(type(number) in (int, float) for number in numbers):
            raise InputError(f"{what} has a {kind} that is no {axes} numbers, one an axis")
        if kind == "scale":
            scale *= numbers
            translation *= numbers
        else:
            translation += numbers
    return tuple(scale.tolist()), tuple(translation.tolist())


def selection_of(
    axes: Sequence[Axis], shape: Sequence[int], index: Mapping[str, int] | None, what: str
) -> tuple[Any, ...]:
    """What of an array is the volume: all along the axes of space, one index along each other one."""
    if len(shape) != len(axes):
        raise InputError(f"{what} is damaged: an array of {len(shape)} axes, of which {len(axes)} are described")
    if not isinstance(index, (Mapping, type(None))):
        raise TypeError(f'index is {index!r}; expected a dict, such as {{"t": 0}}')
    chosen = dict(index or {})
    others = [(axis, length) for axis, length in zip(axes, shape) if axis.kind != "space"]
    have = ", ".join(f"{one.name} ({one.kind or 'no type'}) 0 to {length - 1}" for one, length in others)
    missing = [axis.name for axis, length in others if length != 1 and axis.name not in chosen]
    if missing:
        example = ", ".join(f'"{name}": 0' for name in missing)
        raise InputError(f"{what} holds several volumes; choose one, as by index={{{example}}}: it has {have}")
    picked: list[Any] = []
    for axis, length in zip(axes, shape):
        if axis.kind == "space":
            picked.append(slice(None))
            continue
        number = chosen.pop(axis.name, 0)
        if not isinstance(number, (int, np.integer)) or not 0 <= number < length:
            raise InputError(f"index has {axis.name!r}: {number!r}; {what} has {have}")
        picked.append(int(number))
    if chosen:
        name = next(iter(chosen))
        raise InputError(f"index has {name!r}, along which nothing is chosen; {what} has {have or 'no further axes'}")
    return tuple(picked)


def geometry_of(
    axes: Sequence[Axis], level: Level, shape: Sequence[int], space: str | None, unit: str | None, what: str
) -> Geometry:
    """Where the voxels of a level lie, of an array of this shape.

    Parameters
    ----------
    space : "LPS" or "RAS"
        Frame of x, y and z.
    unit : str, optional
        Unit of the axes that state none, or one that is unknown.
    """
    if space is None:
        raise InputError(
            f"{what} is OME-Zarr, which does not say whether x grows to the left or to the right of a patient; "
            'pass space="LPS" or space="RAS"'
        )
    if space not in _GROWS:
        raise InputError(f'space is {space!r}; expected "RAS" or "LPS"')
    if unit is not None and unit not in UNITS:
        raise InputError(f"unit is {unit!r}; expected {', '.join(UNITS)}")
    affine, size = np.eye(4), []
    affine[:3, :3] = 0
    spatial = [n for n, axis in enumerate(axes) if axis.kind == "space"]
    for column, n in enumerate(reversed(spatial)):  # the last axis is i
        axis = axes[n]
        if axis.grows not in (None, _GROWS[space][axis.name]):
            raise InputError(
                f'{what} says that {axis.name} leads {axis.grows}; space="{space}" means {_GROWS[space][axis.name]}'
            )
        up, down = UNITS[_unit_of(axis, unit, what)]
        row = "xyz".index(axis.name)
        affine[row, column] = level.scale[n] * up / down
        affine[row, 3] = level.translation[n] * up / down
        size.append(shape[n])
    try:
        return Geometry.from_affine(affine, size, space=space)
    except InputError as error:
        raise InputError(f"{what}: {error}") from None


def _unit_of(axis: Axis, unit: str | None, what: str) -> str:
    if axis.unit is not None and axis.unit in UNITS:
        if unit not in (None, axis.unit):
            raise InputError(f"{what} has the unit {axis.unit} along {axis.name}; unit={unit!r} contradicts it")
        return axis.unit
    if unit is None:
        has = "no unit" if axis.unit is None else f"the unit {axis.unit!r}"
        raise InputError(f"{what} has {has} along {axis.name}; pass unit=, one of {', '.join(UNITS)}")
    return unit


def described(geometry: Geometry, space: str, levels: int, version: str, what: str) -> tuple[list[str], dict[str, Any]]:
    """The names of the axes k, j, i and the attributes of a group that holds a volume, each level every second voxel of
    the one before.

    Raises
    ------
    InputError
        For a grid of which a reader would make another place.
    """
    if space not in _GROWS:
        raise InputError(f'space is {space!r}; expected "RAS" or "LPS"')
    if geometry.slices:
        raise InputError(f"{what}: OME-Zarr has no slices at uneven distances; resample onto geometry.straightened()")
    names = _names_of(geometry, space)
    if names is None:
        other = "RAS" if space == "LPS" else "LPS"
        remedy = "resample onto a grid along x, y, z, or write .mha"
        if _names_of(geometry, other):
            remedy = f'pass space="{other}"'
        raise InputError(
            f'{what}: OME-Zarr says no direction; i, j, k of this volume grow to {", ".join(geometry.orientation)}, '
            f'not along x, y, z of {space}: {remedy}'
        )
    affine = geometry.affine(space)
    scale = [geometry.spacing[column] for column in (2, 1, 0)]
    translation = [float(affine["xyz".index(name), 3]) + 0.0 for name in names]
    image: dict[str, Any] = {
        "name": "volume",
        "axes": [{"name": name, "type": "space", "unit": "millimeter"} for name in names],
        "datasets": [
            {
                "path": str(level),
                "coordinateTransformations": [
                    {"type": "scale", "scale": [step * 2**level for step in scale]},
                    {"type": "translation", "translation": translation},
                ],
            }
            for level in range(levels)
        ],
    }
    if levels > 1:
        image["type"] = "nearest"
    if version == "0.4":
        return names, {"multiscales": [{"version": version, **image}]}
    return names, {"ome": {"version": version, "multiscales": [image]}}


def _names_of(geometry: Geometry, space: str) -> list[str] | None:
    """The axes of space along which k, j and i grow; None where one grows against them or between them."""
    direction = geometry.affine(space)[:3, :3] / geometry.spacing
    whole = np.rint(direction)
    if (whole < 0).any() or not np.array_equal(whole @ whole.T, np.eye(3)):
        return None
    reach = np.array(geometry.spacing) * (np.array(geometry.size) - 1)
    if (np.abs(direction - whole) @ reach > _SAME_PLACE_MM).any():
        return None
    return ["xyz"[int(whole[:, column].argmax())] for column in (2, 1, 0)]
