# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Random deformations for training: families of them, and with each a certificate.

    family = tw.augmentation.Elastic(amplitude=(1, 5), spacing=(30, 60))
    warp = tw.augmentation.draw(family, ct.geometry, seed=7)
    done = warp.deform(ct, labels=[organs])     # done.certificate

What `tetwarp.monai` and `tetwarp.torchio` are made of (docs/guide/learning.md).
"""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import json
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from . import _calls, _core, adapters, fields
from .deforming import Along, deform, move_points
from .errors import InputError
from .field import PullField, VertexField
from .geometry import Geometry
from .simulation import simulate
from .volume import Volume

FloatArray = npt.NDArray[np.float64]
#: Smallest and largest value of a uniform draw.
Range = tuple[float, float]

#: By how much a field that folds is shrunk, and how often at most.
_SHRINK, _MOST_SHRINKS = 0.8, 40


def _range(value: float | Range, name: str, least: float = -np.inf) -> Range:
    pair = value if isinstance(value, Sequence) else (value, value)
    if isinstance(pair, str) or len(pair) != 2:
        raise InputError(f"{name} is {value!r}; expected a number, or the smallest and the largest one")
    low, high = (_calls.number(one, name) for one in pair)
    if low > high:
        raise InputError(f"{name} is {value!r}; expected the smaller value first")
    if low < least:
        raise InputError(f"{name} is {value!r}; expected no less than {least:g}")
    return low, high


def _places(geometry: Geometry) -> FloatArray:
    """Place of each vertex, (k, j, i, 3), LPS mm."""
    k, j, i = np.meshgrid(*(np.arange(n, dtype=np.float64) for n in geometry.shape), indexing="ij")
    return geometry.point(np.stack([i, j, k], axis=-1))


def never_folding_amplitude(geometry: Geometry, spacing: float, cell_size: int) -> float:
    """Largest amplitude in mm with which an elastic field surely folds nowhere.

    A cubic B-spline whose coefficients are at most A changes along an axis by at most 1.5 A / spacing. In each of the five
    tetrahedra of a cell with edges h, the affine map of the differences then has a row sum of at most
    1.5 A / spacing * (h_x + h_y + h_z) / h_min, in cells; below 1 the determinant stays above 0. A direction that is
    turned counts with the largest sum of its cosines, squared. Rounding to 2^-12 voxel takes less than a hundredth.

    Parameters
    ----------
    geometry : Geometry
        Grid of the volume.
    spacing : float
        Distance of control points, mm.
    cell_size : int

    Examples
    --------
    >>> round(never_folding_amplitude(Geometry((64, 64, 64)), spacing=45, cell_size=4), 2)
    9.9
    """
    geometry = geometry.straightened()
    edges = np.array(geometry.spacing) * cell_size
    turned = float(np.abs(geometry.direction).sum(axis=0).max())
    return float(0.99 * spacing * edges.min() / (1.5 * edges.sum() * turned**2))


#: Families by their names.
FAMILIES: dict[str, type[Family]] = {}


class Family:
    """A kind of random deformation. It draws parameters, which are plain numbers, and makes fields of them.

    A class of one's own is known by its name, as those here are.
    """

    #: Whether the field follows from the image, too. Then `field` takes the first image as a fourth argument, and what
    #: it gives goes into records.
    takes_image = False

    def __init_subclass__(cls) -> None:
        FAMILIES[cls.__name__] = cls

    def draw(self, random: np.random.Generator, geometry: Geometry, cell_size: int) -> dict[str, Any]:
        """Parameters of one deformation of a volume; what `json` can write."""
        raise NotImplementedError

    # Families that take an image have one argument more.
    field: ClassVar[Callable[..., VertexField]]
    """The field of parameters on a lattice over a grid: `field(parameters, geometry, cell_size)`, a static method."""


@dataclasses.dataclass(frozen=True)
class Elastic(Family):
    """Smooth random fields of cubic B-splines, as `fields.elastic`. They never fold, by construction.

    Parameters
    ----------
    amplitude : float or (float, float)
        Largest component of a displacement, mm, drawn from the range; at most `never_folding_amplitude`.
    spacing : float or (float, float)
        Distance of control points, mm.
    may_fold : bool
        Takes amplitudes beyond that bound, too; a field that does fold is shrunk.

    Examples
    --------
    >>> Elastic(amplitude=(1, 4), spacing=40).amplitude
    (1, 4)
    """

    amplitude: float | Range = (1.0, 5.0)
    spacing: float | Range = (30.0, 60.0)
    may_fold: bool = False

    def draw(self, random: np.random.Generator, geometry: Geometry, cell_size: int) -> dict[str, Any]:
        spacing = random.uniform(*_range(self.spacing, "spacing", 0))
        amplitude = random.uniform(*_range(self.amplitude, "amplitude", 0))
        if not self.may_fold:
            amplitude = min(amplitude, never_folding_amplitude(geometry, spacing, cell_size))
        return {"amplitude": amplitude, "spacing": spacing, "seed": int(random.integers(2**63))}

    @staticmethod
    def field(parameters: Mapping[str, Any], geometry: Geometry, cell_size: int) -> VertexField:
        return fields.elastic(geometry, cell_size=cell_size, **parameters)


@dataclasses.dataclass(frozen=True)
class ElasticAffine(Family):
    """A rotation and scaling about the middle of the volume and a shift, and on it an elastic field.

    Parameters
    ----------
    amplitude, spacing
        As of `Elastic`.
    angle : float or (float, float)
        Degrees about each of x, y and z, drawn one by one.
    scale : float or (float, float)
        Of each axis, drawn one by one.
    shift : float or (float, float)
        mm along each axis, drawn one by one.
    """

    amplitude: float | Range = (1.0, 5.0)
    spacing: float | Range = (30.0, 60.0)
    angle: float | Range = (-10.0, 10.0)
    scale: float | Range = (0.9, 1.1)
    shift: float | Range = (-5.0, 5.0)

    def draw(self, random: np.random.Generator, geometry: Geometry, cell_size: int) -> dict[str, Any]:
        elastic = Elastic(self.amplitude, self.spacing).draw(random, geometry, cell_size)
        return {
            **elastic,
            "angle": random.uniform(*_range(self.angle, "angle"), 3).tolist(),
            "scale": random.uniform(*_range(self.scale, "scale"), 3).tolist(),
            "shift": random.uniform(*_range(self.shift, "shift"), 3).tolist(),
            "centre": geometry.centre.tolist(),
        }

    @staticmethod
    def field(parameters: Mapping[str, Any], geometry: Geometry, cell_size: int) -> VertexField:
        field = Elastic.field({name: parameters[name] for name in ("amplitude", "spacing", "seed")}, geometry, cell_size)
        assert field.lattice is not None
        matrix = np.diag(parameters["scale"])
        for axis, angle in enumerate(np.radians(parameters["angle"])):
            turn, (first, second) = np.eye(3), [(1, 2), (2, 0), (0, 1)][axis]
            turn[first, first] = turn[second, second] = np.cos(angle)
            turn[second, first], turn[first, second] = np.sin(angle), -np.sin(angle)
            matrix = turn @ matrix
        places, centre = _places(field.lattice), np.array(parameters["centre"])
        elastic = places + field.displacement - centre  # the elastic field first: it moves what the affine map then takes
        moved = elastic @ matrix.T + centre + parameters["shift"] - places
        return VertexField(field.lattice, np.ascontiguousarray(moved, np.float32))


@dataclasses.dataclass(frozen=True)
class Breathing(Family):
    """A motion like breathing: towards the feet, most in a plane between chest and abdomen, and the belly forwards.

    u_z = -A exp(-(d / w)^2 / 2), where d is the distance from that plane along z; u_y = -A r (1 - d' / D) of the same
    profile, where d' is the distance from the front of the volume and D its depth.

    Parameters
    ----------
    amplitude : float or (float, float)
        A, mm.
    width : float or (float, float)
        w as a share of the volume's length along z.
    level : float or (float, float)
        Of the plane, as a share of that length, from the feet.
    rise : float or (float, float)
        r, how far the front goes, as a share of A.
    """

    amplitude: float | Range = (3.0, 15.0)
    width: float | Range = (0.15, 0.3)
    level: float | Range = (0.35, 0.65)
    rise: float | Range = (0.1, 0.4)

    def draw(self, random: np.random.Generator, geometry: Geometry, cell_size: int) -> dict[str, Any]:
        corners = geometry.point([[i, j, k] for i in (0, geometry.size[0] - 1) for j in (0, geometry.size[1] - 1)
                                  for k in (0, geometry.size[2] - 1)])  # fmt: skip
        low, high = corners.min(axis=0), corners.max(axis=0)
        length, depth = float(high[2] - low[2]), float(high[1] - low[1])
        return {
            "amplitude": random.uniform(*_range(self.amplitude, "amplitude")),
            "width": random.uniform(*_range(self.width, "width")) * length,
            "level": float(low[2]) + random.uniform(*_range(self.level, "level")) * length,
            "rise": random.uniform(*_range(self.rise, "rise")),
            "front": float(low[1]),
            "depth": depth,
        }

    @staticmethod
    def field(parameters: Mapping[str, Any], geometry: Geometry, cell_size: int) -> VertexField:
        lattice = geometry.lattice(cell_size)
        places = _places(lattice)
        profile = parameters["amplitude"] * np.exp(-(((places[..., 2] - parameters["level"]) / parameters["width"]) ** 2) / 2)
        depth = np.clip(1 - (places[..., 1] - parameters["front"]) / parameters["depth"], 0, 1)
        moved = np.zeros(places.shape, np.float32)
        moved[..., 2] = -profile
        moved[..., 1] = -parameters["rise"] * profile * depth
        return VertexField(lattice, moved)


@dataclasses.dataclass(frozen=True)
class Swelling(Family):
    """Tissue that swells or shrinks about a place, as `fields.bubble`.

    Parameters
    ----------
    radius : float or (float, float)
        mm.
    strength : float or (float, float)
        a of the formula.
    """

    radius: float | Range = (20.0, 60.0)
    strength: float | Range = (-0.5, 1.0)

    def draw(self, random: np.random.Generator, geometry: Geometry, cell_size: int) -> dict[str, Any]:
        at = random.uniform(0.25, 0.75, 3) * (np.array(geometry.size) - 1)
        return {
            "radius": random.uniform(*_range(self.radius, "radius")),
            "strength": random.uniform(*_range(self.strength, "strength")),
            "center": geometry.point(at).tolist(),
        }

    @staticmethod
    def field(parameters: Mapping[str, Any], geometry: Geometry, cell_size: int) -> VertexField:
        return fields.bubble(geometry, cell_size=cell_size, **parameters)


@dataclasses.dataclass(frozen=True)
class Simulated(Family):
    """A ball of tissue is pulled aside and what hangs on it follows, by ChainMail (`tetwarp.simulate`).

    The field depends on the image, a CT in HU: bone is stiff, lung and fat give way, air hardly holds. The faces of the
    grid stay.

    Parameters
    ----------
    displacement : float or (float, float)
        How far the ball is pulled, mm, in a direction that is drawn evenly from the sphere.
    radius : float or (float, float)
        Of the ball, mm.
    middle : float or (float, float)
        Where the ball lies on each axis of the body's box, as a share of its side.
    """

    displacement: float | Range = (5.0, 20.0)
    radius: float | Range = (15.0, 40.0)
    middle: float | Range = (0.25, 0.75)

    takes_image = True

    def draw(self, random: np.random.Generator, geometry: Geometry, cell_size: int) -> dict[str, Any]:
        direction = random.normal(size=3)
        by = direction / np.linalg.norm(direction) * random.uniform(*_range(self.displacement, "displacement", 0))
        return {
            "at": random.uniform(*_range(self.middle, "middle"), 3).tolist(),
            "radius": random.uniform(*_range(self.radius, "radius", 0)),
            "by": by.tolist(),
        }

    @staticmethod
    def field(parameters: Mapping[str, Any], geometry: Geometry, cell_size: int, image: Volume) -> VertexField:
        page = {
            "method": "chainmail",
            "cell_size": cell_size,
            "tissues": [
                {"name": "bone", "hu": [400, None], "compression": 0, "stretch": 0, "shear": 0},
                {"name": "air", "hu": [None, -950], "compression": 0.6, "stretch": 2, "shear": 2},
                {"name": "lung", "hu": [-950, -400], "compression": 0.3, "stretch": 0.3, "shear": 0.3},
                {"name": "soft tissue", "compression": 0.15, "stretch": 0.2, "shear": 0.2},
            ],
            "hold": [{"border": True}],
            "move": [
                {
                    "handle": {"at": {"body": parameters["at"]}, "radius_mm": parameters["radius"]},
                    "by_mm": parameters["by"],
                }
            ],
        }
        on_host = image if isinstance(image.array, np.ndarray) else Volume(image.array.cpu().numpy(), image.geometry)
        return simulate(page, on_host, backend="cpu").field


@dataclasses.dataclass
class Warped:
    """What `Warp.deform` gives."""

    #: Deformed images, in their order, each of the type of what was given.
    images: list[Any]
    #: Deformed labels.
    labels: list[Any]
    #: What was done and what came of it; what `json` can write.
    certificate: dict[str, Any]
    #: The deformation as it was done: shrunk, if it had to be. Its `undo` pulls back.
    warp: Warp


@dataclasses.dataclass(frozen=True)
class Warp:
    """One drawn deformation. The same numbers make the same bits on every machine.

    Parameters
    ----------
    family : str
        Name of a class of this module.
    parameters : dict
        As `Family.draw` has them.
    geometry : Geometry
        Grid over which it was drawn.
    cell_size : int
        Voxels between vertices; with smaller cells the field is smoother, and takes longer.
    shrunk : int
        How often all displacements are multiplied by 0.8.
    held : VertexField, optional
        Of a family that takes an image: the field, before it is shrunk. `deform` finds it, and `Warped.warp` has it.
    """

    family: str
    parameters: Mapping[str, Any]
    geometry: Geometry
    cell_size: int = 8
    shrunk: int = 0
    held: VertexField | None = dataclasses.field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        if self.family not in FAMILIES:
            raise InputError(f"there is no family {self.family!r}; expected one of {', '.join(FAMILIES)}")
        _calls.whole(self.cell_size, "cell_size", 1, 65536)

    @property
    def share(self) -> float:
        """What is left of each displacement, 1 or less."""
        return float(_SHRINK**self.shrunk)

    def field(self, grids: Sequence[Geometry] = ()) -> VertexField:
        """The forward field.

        Its lattice holds the grid over which it was drawn and others, and reaches so far beyond them that what moves in
        has somewhere to come from.

        Parameters
        ----------
        grids : sequence of Geometry
            Of other images that go through it.
        """
        make = FAMILIES[self.family].field
        if FAMILIES[self.family].takes_image:
            if self.held is None:
                raise InputError(f"the field of a {self.family} follows from the image; deform one, and take Warped.warp")
            return self._shrunk(self.held)
        straight = self.geometry.straightened()

        size = np.array(straight.size)

        # Pairs of cells on either side: vertices, the tetrahedra of cells and the middle lie where they lie without them.
        def grown(pairs: npt.NDArray[np.int64]) -> Geometry:
            margin = 2 * self.cell_size * pairs
            return Geometry(
                (size + 2 * margin).tolist(), straight.spacing, straight.point(-margin).tolist(), straight.direction
            )

        beyond = np.zeros(3)
        ends = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
        for grid in grids:
            corners = straight.index(grid.point(ends * (np.array(grid.size) - 1)))
            beyond = np.maximum(beyond, np.maximum(-corners.min(axis=0), corners.max(axis=0) - size + 1) - 1e-6)
        inner = make(self.parameters, grown(_pairs(beyond, self.cell_size)), self.cell_size)
        farthest = np.abs(inner.displacement).reshape(-1, 3).max(axis=0)
        beyond += np.abs(straight.direction.T) @ farthest / np.array(straight.spacing) + self.cell_size
        field = make(self.parameters, grown(_pairs(beyond, self.cell_size)), self.cell_size)
        return self._shrunk(field)

    def _shrunk(self, field: VertexField) -> VertexField:
        assert field.lattice is not None
        return VertexField(field.lattice, field.displacement * np.float32(self.share))

    def _with_field_of(self, image: Volume) -> Warp:
        """This one; of a family that takes an image, with the field of that image."""
        family = FAMILIES[self.family]
        if not family.takes_image or self.held is not None:
            return self
        if image.geometry != self.geometry:
            raise InputError(f"the first image lies on another grid than that over which the {self.family} was drawn")
        return dataclasses.replace(self, held=family.field(self.parameters, self.geometry, self.cell_size, image))

    def deform(
        self,
        *images: Any,
        labels: Sequence[Any] = (),
        interpolation: str = "linear",
        backgrounds: Sequence[float | None] | None = None,
        backend: str = "auto",
        threads: int = 0,
    ) -> Warped:
        """Sends images and labels through the field, each on its own grid, and says what came of it.

        Parameters
        ----------
        images : Volume, or images of other libraries, as `tetwarp.deform` takes them
        labels : sequence
            Go by vote.
        interpolation : "linear" or "cubic"
        backgrounds : sequence, optional
            Of the images, where nothing maps; None: the smallest value.

        Raises
        ------
        InputError
            For a field that still folds after 40 shrinks.
        """
        # Each is read once, whatever library it comes from.
        read = [adapters.volume_of(one) for one in (*images, *labels)]
        everything = [volume for volume, _ in read]
        if not everything:
            raise InputError("there is nothing to deform; pass an image or labels")
        values = list(backgrounds) if backgrounds is not None else [None] * len(images)
        kinds: list[tuple[str, float | None]] = [(interpolation, value) for value in values]
        kinds += [("vote", 0.0) for _ in labels]
        # Those that share the first one's grid share its voxels' owners, too.
        grids = [volume.geometry for volume in everything]
        alone = [grid != grids[0] for grid in grids]
        warp = self._with_field_of(everything[0])
        # What is simulated ends with the grid, whose faces stay; other fields reach beyond it.
        outside = "rest" if FAMILIES[self.family].takes_image else "background"
        for _ in range(_MOST_SHRINKS):
            field = warp.field(grids)
            done = deform(
                everything[0],
                field,
                interpolation=kinds[0][0],
                background=kinds[0][1],
                outside=outside,
                with_=[
                    Along(one, kind, background, own=own)
                    for one, own, (kind, background) in zip(everything[1:], alone[1:], kinds[1:])
                ],
                backend=backend,
                threads=threads,
            )
            if done.report.inverted + done.report.degenerate == 0:
                break
            warp = dataclasses.replace(warp, shrunk=warp.shrunk + 1)
        else:
            raise InputError(f"the field folds even when it is shrunk {_MOST_SHRINKS} times; draw smaller displacements")
        results = [done.volume, *done.volumes]
        certificate = {
            **warp.record(),
            "inverted": done.report.inverted,
            "degenerate": done.report.degenerate,
            "jacobian": [done.report.jacobian_min, done.report.jacobian_max],
            "uncovered": done.report.uncovered,
            "labels": [
                _volumes_of(before, after) for before, after in zip(everything[len(images) :], results[len(images) :])
            ],
        }
        given_back = [back(result) for (_, back), result in zip(read, results)]
        return Warped(given_back[: len(images)], given_back[len(images) :], certificate, warp)

    def undo(self, image: Any, *, interpolation: str = "linear", background: float | None = None) -> Any:
        """An image that was deformed, pulled back: each voxel takes what lies where the forward map leads its centre.

        Deforming and undoing interpolates twice, and what left the grid is lost. A field that had to be shrunk is undone
        by `Warped.warp`.
        """
        volume, back = adapters.volume_of(image)
        grid = volume.geometry.straightened()
        places = _places(grid).reshape(-1, 3)
        moved, inside = move_points(places, self.field([grid]), grid)
        moved[~inside] = np.nan
        pull = PullField(grid, np.ascontiguousarray((moved - places).reshape(*grid.shape, 3), np.float32))
        done = deform(volume, pull_field=pull, interpolation=interpolation, background=background, outside="background")
        return back(done.volume)

    def record(self) -> dict[str, Any]:
        """All that makes it, for `of_record`; what `json` can write.

        A field that follows from an image is part of it: float32, x, y, z of each vertex, i fastest, as Base64.
        """
        record = {
            "family": self.family,
            "parameters": dict(self.parameters),
            "geometry": _state_of(self.geometry),
            "cell_size": self.cell_size,
            "shrunk": self.shrunk,
            "share": self.share,
        }
        if self.held is not None:
            assert self.held.lattice is not None
            values = np.ascontiguousarray(self.held.displacement, "<f4").tobytes()
            record["field"] = {
                "lattice": _state_of(self.held.lattice),
                "displacement": base64.b64encode(values).decode(),
            }
        return record

    @classmethod
    def of_record(cls, record: Mapping[str, Any]) -> Warp:
        """A warp of its record, or of a certificate: the same bits once more.

        Examples
        --------
        >>> warp = draw(Elastic(), Geometry((32, 32, 32)), seed=3)
        >>> Warp.of_record(json.loads(json.dumps(warp.record()))) == warp
        True
        """
        try:
            geometry = _geometry_of_state(record["geometry"])
            held = None
            if "field" in record:
                lattice = _geometry_of_state(record["field"]["lattice"])
                values = np.frombuffer(base64.b64decode(record["field"]["displacement"], validate=True), "<f4")
                held = VertexField(lattice, values.astype(np.float32).reshape(*lattice.shape, 3))
            family, parameters, cell_size, shrunk = (record[name] for name in ("family", "parameters", "cell_size", "shrunk"))
        except (KeyError, TypeError, ValueError) as missing:
            raise InputError(f"this is no record of a deformation: {missing}") from None
        return cls(family, dict(parameters), geometry, cell_size, shrunk, held)


def draw(family: Family, geometry: Geometry, *, seed: int | np.random.Generator, cell_size: int = 8) -> Warp:
    """Draws a deformation of a volume.

    Parameters
    ----------
    family : Family
    geometry : Geometry
        Grid of the volume.
    seed : int or numpy.random.Generator
    cell_size : int
        Voxels between vertices; with smaller cells the field is smoother, and takes longer.

    Examples
    --------
    >>> warp = draw(Swelling(radius=8, strength=0.5), Geometry((32, 32, 32)), seed=1)
    >>> warp.family, warp.share
    ('Swelling', 1.0)
    """
    cell_size = _calls.whole(cell_size, "cell_size", 1, 65536)
    random = seed if isinstance(seed, np.random.Generator) else np.random.default_rng(seed)
    return Warp(type(family).__name__, family.draw(random, geometry, cell_size), geometry, cell_size)


def seed_of(seed: int, epoch: int, key: Any) -> int:
    """The seed of a sample in an epoch: 63 bits of a SHA-256 of the three, whatever the worker and the order.

    Parameters
    ----------
    key : str or int
        Names the sample.

    Raises
    ------
    InputError
        For a key of another type: what a text says of it may not tell samples apart.

    Examples
    --------
    >>> seed_of(7, 0, "case-12") == seed_of(7, 0, "case-12") != seed_of(7, 1, "case-12")
    True
    """
    if not isinstance(key, str):
        try:
            key = operator.index(key)
        except TypeError:
            raise InputError(f"a sample is named by a {type(key).__name__}; expected a text or a whole number") from None
    text = json.dumps([seed, epoch, str(key)])
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little") >> 1


def _state_of(geometry: Geometry) -> dict[str, list[float]]:
    """The numbers of a grid, by name."""
    size, spacing, origin, direction, slices = geometry._state()
    grid = {"size": size, "spacing": spacing, "origin": origin, "direction": direction, "slices": slices}
    return {name: list(numbers) for name, numbers in grid.items()}


def _geometry_of_state(state: Mapping[str, Any]) -> Geometry:
    grid = dict(state)
    direction = np.array(grid.pop("direction"), np.float64).reshape(3, 3)
    return Geometry(**grid, direction=direction)


def _pairs(voxels: FloatArray, cell_size: int) -> npt.NDArray[np.int64]:
    """How many pairs of cells reach over so many voxels on each axis."""
    return np.ceil(voxels / (2 * cell_size)).astype(np.int64)


def _volumes_of(before: Volume, after: Volume) -> dict[str, list[float]]:
    """Volume of each label before and after, ml."""
    volumes: dict[str, list[float]] = {}
    for n, volume in enumerate((before, after)):
        affine = volume.geometry.straightened().affine("LPS")
        millilitres = abs(float(np.linalg.det(affine[:3, :3]))) / 1000
        for label, count in _counts(volume):
            if label != 0:
                volumes.setdefault(str(label), [0.0, 0.0])[n] = count * millilitres
    return volumes


def _counts(volume: Volume) -> list[tuple[Any, int]]:
    """The values of a volume, and how many voxels have each: of one on a device, counted there."""
    array = volume.array
    if isinstance(array, np.ndarray):
        kind = array.dtype.type
        return [(kind(value), count) for value, count in _core.count_values(array, volume.geometry._grid).items()]
    values, counts = (one.cpu().numpy() for one in array.unique(return_counts=True))
    return [(value, int(count)) for value, count in zip(values, counts)]
