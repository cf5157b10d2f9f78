# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Where the samples of a volume or field lie in the patient."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _arrays, _calls, _core
from .errors import InputError

FloatArray = npt.NDArray[np.float64]

_LPS_FROM = {"LPS": np.diag([1.0, 1.0, 1.0, 1.0]), "RAS": np.diag([-1.0, -1.0, 1.0, 1.0])}


def _flip_of(space: str) -> FloatArray:
    try:
        return _LPS_FROM[space]
    except (KeyError, TypeError):
        raise InputError(f'space is {space!r}; expected "RAS" or "LPS"') from None


def _numbers(values: Any, count: int, name: str) -> tuple[float, ...]:
    try:
        numbers = tuple(float(value) for value in values)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} is no {count} numbers that a float holds") from None
    if len(numbers) != count:
        raise InputError(f"{name} has {len(numbers)} numbers; expected {count}")
    return numbers


def _along(values: FloatArray, known: npt.NDArray[Any], mapped: npt.NDArray[Any]) -> FloatArray:
    """Linear between the known places and beyond their ends."""
    n = np.clip(np.searchsorted(known, values, side="right") - 1, 0, len(known) - 2)
    share = (values - known[n]) / (known[n + 1] - known[n])
    return np.asarray(mapped[n] + share * (mapped[n + 1] - mapped[n]), dtype=np.float64)


class Geometry:
    """A grid of samples in the patient: size, spacing, origin and direction, in LPS millimetres.

    LPS is the frame of DICOM and ITK: x grows to the patient's left, y to the back, z to the head.

    Parameters
    ----------
    size : (int, int, int)
        Samples along i, j and k. An array of the grid has the shape (k, j, i).
    spacing : (float, float, float)
        Millimetres between neighbouring samples along i, j, k.
    origin : (float, float, float)
        Centre of sample (0, 0, 0), LPS mm.
    direction : array_like, 3 x 3
        Its columns are the unit vectors of i, j, k in LPS.
    slices : sequence of float, optional
        Position along k of each slice of an uneven stack, mm, from 0 upwards.

    Raises
    ------
    InputError
        For numbers that make no grid: sizes below 1, spacings out of 1e-6 to 1e6 mm, a direction without an inverse.

    Examples
    --------
    >>> grid = Geometry((4, 3, 2), spacing=(0.5, 0.5, 2.0), origin=(-10, 0, 5))
    >>> grid.shape
    (2, 3, 4)
    >>> grid.point([3, 0, 1])
    array([-8.5,  0. ,  7. ])
    """

    __slots__ = ("_grid", "_numbers", "_straight")

    _grid: _core.Grid
    #: Size, spacing, origin, rows of the direction, slices: what an operator of PyTorch takes in the place of a grid.
    _numbers: tuple[float, ...]
    #: The same of the straightened grid.
    _straight: tuple[float, ...]

    def __init__(
        self,
        size: Sequence[int],
        spacing: Sequence[float] = (1.0, 1.0, 1.0),
        origin: Sequence[float] = (0.0, 0.0, 0.0),
        direction: npt.ArrayLike | None = None,
        slices: Sequence[float] = (),
    ) -> None:
        whole = _numbers(size, 3, "size")
        if any(number != int(number) or abs(number) > 2**40 for number in whole if np.isfinite(number)) or not all(
            np.isfinite(whole)
        ):
            raise InputError(f"size is {tuple(size)!r}; expected three whole numbers (i, j, k)")
        matrix = np.eye(3) if direction is None else _arrays.numbers(direction, np.float64, "direction")
        if matrix.shape != (3, 3):
            raise InputError(f"direction has the shape {matrix.shape}; expected (3, 3)")
        grid = _core.Grid(
            [int(number) for number in whole],
            _numbers(spacing, 3, "spacing"),
            _numbers(origin, 3, "origin"),
            matrix.ravel().tolist(),
            _arrays.numbers(slices, np.float64, "slices").ravel().tolist(),
        )
        self._keep(grid)

    def _keep(self, grid: _core.Grid) -> None:
        def numbers(of: _core.Grid) -> tuple[float, ...]:
            return (*map(float, of.size), *of.spacing, *of.origin, *of.direction, *of.slices)

        object.__setattr__(self, "_grid", grid)
        object.__setattr__(self, "_numbers", numbers(grid))
        object.__setattr__(self, "_straight", numbers(grid.straightened()))

    @classmethod
    def _of(cls, grid: _core.Grid) -> Geometry:
        geometry = cls.__new__(cls)
        geometry._keep(grid)
        return geometry

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a Geometry does not change; make a new one with another {name}")

    @property
    def size(self) -> tuple[int, int, int]:
        """Samples along i, j and k."""
        i, j, k = self._grid.size
        return (i, j, k)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of an array of the grid: samples along k, j and i."""
        i, j, k = self._grid.size
        return (k, j, i)

    @property
    def spacing(self) -> tuple[float, float, float]:
        """Millimetres between neighbouring samples along i, j, k."""
        x, y, z = self._grid.spacing
        return (x, y, z)

    @property
    def origin(self) -> tuple[float, float, float]:
        """Centre of sample (0, 0, 0), LPS mm."""
        x, y, z = self._grid.origin
        return (x, y, z)

    @property
    def direction(self) -> FloatArray:
        """3 x 3, read-only; its columns are the unit vectors of i, j, k in LPS."""
        matrix = np.array(self._grid.direction, dtype=np.float64).reshape(3, 3)
        matrix.flags.writeable = False
        return matrix

    @property
    def slices(self) -> tuple[float, ...]:
        """Position along k of each slice of an uneven stack, mm; empty for an even one."""
        return tuple(self._grid.slices)

    @property
    def orientation(self) -> str:
        """Letters of the directions in which i, j and k grow: "LPS" for the identity direction."""
        return self._grid.orientation()

    @property
    def centre(self) -> FloatArray:
        """Middle of the grid, LPS mm: the mean of its eight corner samples."""
        return np.array(self._grid.centre())

    @classmethod
    def from_affine(cls, affine: npt.ArrayLike, shape: Sequence[int], *, space: str) -> Geometry:
        """The grid of a 4 x 4 matrix that takes an index (i, j, k, 1) to millimetres, as nibabel has it.

        Parameters
        ----------
        affine : array_like, 4 x 4
            Its columns need not be perpendicular; their lengths are the spacing.
        shape : (int, int, int)
            Samples along i, j, k: the shape of nibabel's array.
        space : "RAS" or "LPS"
            Frame of the millimetres. nibabel and MONAI have RAS, SimpleITK and DICOM LPS.

        Examples
        --------
        >>> Geometry.from_affine(np.diag([2, 2, 3, 1]), (4, 4, 4), space="RAS").orientation
        'RAS'
        """
        flip = _flip_of(space)
        matrix = _arrays.numbers(affine, np.float64, "affine")
        if matrix.shape != (4, 4) or not np.array_equal(matrix[3], [0, 0, 0, 1]):
            raise InputError(f"affine has the shape {matrix.shape}; expected (4, 4) with the last row 0, 0, 0, 1")
        matrix = flip @ matrix
        spacing = np.linalg.norm(matrix[:3, :3], axis=0)
        if not np.all(np.isfinite(spacing)) or np.any(spacing == 0):
            raise InputError("affine has a column of length 0 or numbers that are not finite")
        return cls(tuple(shape), spacing.tolist(), matrix[:3, 3].tolist(), matrix[:3, :3] / spacing)

    def affine(self, space: str) -> FloatArray:
        """The 4 x 4 matrix that takes an index (i, j, k, 1) to millimetres in "RAS" or "LPS".

        Examples
        --------
        >>> Geometry((2, 2, 2), spacing=(1, 2, 3)).affine("LPS").diagonal()
        array([1., 2., 3., 1.])
        """
        if self.slices:
            raise InputError("slices at uneven distances have no affine; take that of straightened()")
        return _flip_of(space) @ self._even_affine()

    def _even_affine(self) -> FloatArray:
        matrix = np.eye(4)
        matrix[:3, :3] = self.direction * np.array(self.spacing)
        matrix[:3, 3] = self.origin
        return matrix

    def point(self, index: npt.ArrayLike) -> FloatArray:
        """LPS mm of continuous indices (i, j, k); the last axis of `index` has length 3."""
        matrix = self._even_affine()
        place = np.array(_arrays.numbers(index, np.float64, "indices"))
        if self.slices:  # the index along k counts even steps in the matrix
            place[..., 2] = _along(place[..., 2], np.arange(len(self.slices)), np.array(self.slices) / self.spacing[2])
        return np.asarray(place @ matrix[:3, :3].T + matrix[:3, 3])

    def index(self, point: npt.ArrayLike) -> FloatArray:
        """Continuous indices (i, j, k) of points in LPS mm; the last axis of `point` has length 3."""
        matrix = self._even_affine()
        places = _arrays.numbers(point, np.float64, "points")
        index = np.array((places - matrix[:3, 3]) @ np.linalg.inv(matrix[:3, :3]).T)
        if self.slices:
            index[..., 2] = _along(index[..., 2], np.array(self.slices) / self.spacing[2], np.arange(len(self.slices)))
        return index

    def lattice(self, cell_size: int) -> Geometry:
        """The lattice with a vertex on every `cell_size`-th voxel. Its last cells may reach beyond the volume."""
        return Geometry._of(self._grid.lattice(_calls.whole(cell_size, "cell_size", 1, 65536)))

    def straightened(self) -> Geometry:
        """The straight, even grid onto which a tilted or uneven stack is resampled; any other grid itself."""
        straight = self._grid.straightened()
        return self if straight == self._grid else Geometry._of(straight)

    def _state(self) -> tuple[Any, ...]:
        return (self.size, self.spacing, self.origin, tuple(self._grid.direction), self.slices)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Geometry) and (other is self or self._grid == other._grid)

    def __hash__(self) -> int:
        return hash(self._state())

    def __reduce__(self) -> tuple[Any, ...]:
        size, spacing, origin, direction, slices = self._state()
        return (Geometry, (size, spacing, origin, np.array(direction).reshape(3, 3), slices))

    def __repr__(self) -> str:
        i, j, k = self.size
        spacing = " x ".join(f"{value:g}" for value in self.spacing)
        return f"<Geometry {i} x {j} x {k}, {spacing} mm, {self.orientation}>"
