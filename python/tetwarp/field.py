# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Fields: where places go. Forward and pull fields are two types, and neither is taken for the other."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from . import _arrays, _core
from .errors import InputError
from .geometry import Geometry


def _displacement(array: Any, geometry: Geometry, name: str) -> Any:
    array = _arrays.require_array(array, name)
    if tuple(array.shape) != (*geometry.shape, 3):
        raise InputError(f"{name} has the shape {tuple(array.shape)}; expected {(*geometry.shape, 3)}: k, j, i, and x, y, z")
    if str(array.dtype).rpartition(".")[2] != "float32":
        raise InputError(f"{name} holds {array.dtype}; expected float32")
    _arrays.require_dense(array, name)
    return array


class TetrahedralMesh:
    """Tetrahedra of any size, as finite element programs write them. Inside each the map is affine.

    Parameters
    ----------
    rest : array_like, (n, 3), float64
        Undeformed place of each vertex, LPS mm.
    displacement : array_like, (n, 3), float32
        Deformed minus undeformed place, LPS mm.
    tetrahedra : array_like, (m, 4), uint32
        Four vertex numbers each.
    lattice_vertex : array_like, (n,), int64, optional
        For a mesh that was made of a lattice: the number of the lattice vertex (i fastest) at which each vertex rests,
        or -1.

    Examples
    --------
    >>> corner = [[0, 0, 0], [9, 0, 0], [0, 9, 0], [0, 0, 9]]
    >>> mesh = TetrahedralMesh(corner, np.zeros((4, 3)), [[0, 1, 2, 3]])
    >>> len(mesh.tetrahedra)
    1
    """

    __slots__ = ("displacement", "lattice_vertex", "rest", "tetrahedra")

    def __init__(
        self,
        rest: npt.ArrayLike,
        displacement: npt.ArrayLike,
        tetrahedra: npt.ArrayLike,
        lattice_vertex: npt.ArrayLike | None = None,
    ) -> None:
        self.rest = _arrays.numbers(rest, np.float64, "the mesh's rest")
        self.displacement = _arrays.numbers(displacement, np.float32, "the mesh's displacement")
        self.tetrahedra = _arrays.numbers(tetrahedra, np.uint32, "the mesh's tetrahedra")
        self.lattice_vertex = (
            None if lattice_vertex is None else _arrays.numbers(lattice_vertex, np.int64, "the mesh's lattice_vertex")
        )
        self._core()

    def _core(self) -> _core.MeshArrays:
        arrays = _core.MeshArrays(self.rest, self.displacement, self.tetrahedra, self.lattice_vertex)
        _core.HostField(None, None, arrays, None)  # checks shapes and numbers
        return arrays

    def __repr__(self) -> str:
        return f"<TetrahedralMesh {len(self.rest)} vertices, {len(self.tetrahedra)} tetrahedra>"


class VertexField:
    """A forward field: where each vertex of a lattice or mesh goes.

    Parameters
    ----------
    lattice : Geometry or None
        Grid of the undeformed vertices; None for a mesh that stands alone.
    displacement : array, (k, j, i, 3), float32
        Deformed minus undeformed place of each vertex, x, y, z in LPS mm. On the host or on a CUDA device. Not copied.
    mesh : TetrahedralMesh, optional
        Stands in the place of the lattice, or of the cells in `replaced`.
    replaced : array_like of uint64, optional
        Numbers of the cells (i fastest, rising) whose place the mesh takes.

    Examples
    --------
    >>> lattice = Geometry((3, 3, 3), spacing=(8, 8, 8))
    >>> field = VertexField(lattice, np.zeros((3, 3, 3, 3), np.float32))
    >>> field.lattice.size
    (3, 3, 3)
    """

    __slots__ = ("_lattice", "_numbers", "displacement", "mesh", "notes", "replaced")

    _lattice: Geometry | None
    #: Those of the lattice (`Geometry._numbers`): the compiler of PyTorch 2.4 reads a member, but no member of it.
    _numbers: list[float] | None

    def __init__(
        self,
        lattice: Geometry | None,
        displacement: Any,
        mesh: TetrahedralMesh | None = None,
        replaced: npt.ArrayLike | None = None,
    ) -> None:
        if lattice is not None and not isinstance(lattice, Geometry):
            raise TypeError(f"lattice is a {type(lattice).__name__}; expected a tetwarp.Geometry")
        if mesh is not None and not isinstance(mesh, TetrahedralMesh):
            raise TypeError(f"mesh is a {type(mesh).__name__}; expected a tetwarp.TetrahedralMesh")
        if displacement is None and mesh is None:
            raise InputError("the field has neither a displacement nor a mesh")
        if displacement is not None:
            if lattice is None:
                raise InputError("a displacement without a lattice; pass the lattice's geometry")
            displacement = _displacement(displacement, lattice, "the displacement")
        self.lattice = lattice
        self.displacement = displacement
        self.mesh = mesh
        self.replaced = None if replaced is None else _arrays.numbers(replaced, np.uint64, "the replaced cells")
        #: Remarks about what was read.
        self.notes: list[str] = []

    @property
    def lattice(self) -> Geometry | None:
        """Grid of the undeformed vertices."""
        return self._lattice

    @lattice.setter
    def lattice(self, lattice: Geometry | None) -> None:
        self._lattice = lattice
        self._numbers = None if lattice is None else list(lattice._numbers)

    @classmethod
    def _of(cls, parts: Any, notes: Any = ()) -> VertexField:
        lattice, displacement, mesh, replaced = parts
        if isinstance(displacement, _core.DisplacementCopy):
            displacement = _arrays.DeviceArray(displacement)
        field = cls(
            None if lattice is None else Geometry._of(lattice),
            displacement,
            None if mesh is None else TetrahedralMesh(*mesh),
            replaced,
        )
        field.notes = list(notes)
        return field

    def _host(self) -> _core.HostField:
        """The field as the library has it, its values copied to the host."""
        displacement = _arrays.on_host(self.displacement)
        if displacement is not None and not isinstance(displacement, np.ndarray):
            raise InputError("the displacement lies on a device; this call takes one in host memory")
        return _core.HostField(
            None if self.lattice is None else self.lattice._grid,
            displacement,
            None if self.mesh is None else self.mesh._core(),
            self.replaced,
        )

    def __repr__(self) -> str:
        return f"<VertexField {self.mesh!r}>" if self.displacement is None else f"<VertexField on {self.lattice!r}>"


class PullField:
    """A field that leads from the output back to the input, as registration tools write it.

    Parameters
    ----------
    geometry : Geometry
        Grid of the samples.
    displacement : array, (k, j, i, 3), float32
        Input minus output point of each sample, x, y, z in LPS mm. NaN: there is no input point. Not copied.

    Examples
    --------
    >>> grid = Geometry((2, 2, 2))
    >>> PullField(grid, np.zeros((2, 2, 2, 3), np.float32))
    <PullField on <Geometry 2 x 2 x 2, 1 x 1 x 1 mm, LPS>>
    """

    __slots__ = ("displacement", "geometry", "notes")

    def __init__(self, geometry: Geometry, displacement: Any) -> None:
        if not isinstance(geometry, Geometry):
            raise TypeError(f"geometry is a {type(geometry).__name__}; expected a tetwarp.Geometry")
        self.geometry = geometry
        self.displacement = _displacement(displacement, geometry, "the displacement")
        #: Remarks about what was read.
        self.notes: list[str] = []

    @classmethod
    def from_image(cls, image: Any) -> PullField:
        """The pull field of an image of vectors of SimpleITK or itk, such as registration gives.

        Its vectors are x, y, z in LPS mm, from each point of the output to where its value comes from, as ITK's
        transforms have them. Float64 is rounded to float32; float32 is not copied.

        Raises
        ------
        TypeError
            For images of other libraries, which do not say the axes of their vectors.
        InputError
            For an image that has not three real values a voxel.
        """
        from . import adapters

        return cls(*adapters.displacement_of(image))

    def to_simpleitk(self) -> Any:
        """A copy as SimpleITK.Image of vectors of float64, which `SimpleITK.DisplacementFieldTransform` takes.

        Raises
        ------
        ImportError
            Where SimpleITK is not installed.
        InputError
            For a field on a device, or one with NaN: SimpleITK would take it for a place.
        """
        from .adapters import simpleitk

        if not isinstance(self.displacement, np.ndarray):
            raise InputError("the displacement lies on a device; copy it to the host first")
        if np.isnan(self.displacement).any():
            raise InputError(
                "the pull field has places from which nothing comes (NaN), which SimpleITK does not know; "
                "take a lattice that reaches over the output, or set them to what you want"
            )
        return simpleitk.vector_image(self.geometry, self.displacement)

    def __repr__(self) -> str:
        return f"<PullField on {self.geometry!r}>"


def require_forward(field: Any, instead: str) -> VertexField:
    """The field, if it is a forward one."""
    if isinstance(field, VertexField):
        return field
    if isinstance(field, PullField):
        raise TypeError(f"this is a PullField, which leads from output to input; {instead}")
    raise TypeError(f"the field is a {type(field).__name__}; expected a tetwarp.VertexField")


def require_pull(field: Any, instead: str) -> PullField:
    """The field, if it is a pull field."""
    if isinstance(field, PullField):
        return field
    if isinstance(field, VertexField):
        raise TypeError(f"this is a VertexField, which says where each vertex goes; {instead}")
    raise TypeError(f"the field is a {type(field).__name__}; expected a tetwarp.PullField")
