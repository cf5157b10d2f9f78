# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Deforming tensors of PyTorch, with gradients of the same bits on every run, on the CPU and on CUDA.

    import tetwarp.torch

    moved = tetwarp.torch.deform(volume, displacement, lattice=8)
    loss(moved, fixed).backward()      # volume.grad, displacement.grad

Needs PyTorch 2.4 or later. What has a gradient and what has none: docs/guide/gradients.md.
"""

from __future__ import annotations

import collections
import contextlib
import os
import threading
from collections.abc import Iterator, Sequence
from typing import Any

import torch

from . import _arrays, _calls, _core
from .errors import InputError
from .field import TetrahedralMesh, VertexField
from .geometry import Geometry

if not hasattr(torch.library, "custom_op"):
    raise ImportError(f"tetwarp.torch needs PyTorch 2.4 or later; this is {torch.__version__}")

#: Types whose values are read as they are, and those that are read as float32.
_READ_AS = {
    torch.float32: torch.float32,
    torch.float64: torch.float64,
    torch.float16: torch.float32,
    torch.bfloat16: torch.float32,
    torch.uint8: torch.uint8,
    torch.int16: torch.int16,
    torch.int32: torch.int32,
}

# An operator takes tensors and numbers alone. A grid is the list of its numbers: size, spacing, origin, rows of the
# direction, slices; an empty list is the default, and a lattice of one number is a cell size.
_FIELD = (
    "Tensor displacement, Tensor? rest, Tensor? tetrahedra, Tensor? lattice_vertex, Tensor? replaced, "
    "float[] lattice, float[] geometry, float[] output, str interpolation, str outside"
)


def lattice_shape(shape: Sequence[int], cell_size: int = 8) -> tuple[int, int, int]:
    """Shape (d, h, w) of the displacement for a volume of shape (D, H, W).

    Parameters
    ----------
    shape : (int, int, int)
        Voxels along k, j, i.
    cell_size : int
        A vertex on every `cell_size`-th voxel.

    Examples
    --------
    >>> lattice_shape((64, 64, 41), 8)
    (9, 9, 6)
    """
    if cell_size < 1:
        raise InputError(f"the cell_size is {cell_size}; expected 1 or more voxels")
    k, j, i = (-(-(size - 1) // cell_size) + 1 for size in shape)
    return (k, j, i)


def deform(
    volume: torch.Tensor,
    displacement: torch.Tensor,
    *,
    geometry: Geometry | None = None,
    lattice: int | Geometry | TetrahedralMesh | VertexField = 8,
    output: Geometry | None = None,
    interpolation: str = "linear",
    outside: str = "refuse",
    background: float = 0.0,
) -> torch.Tensor:
    """Deforms a batch of volumes, each by its own field: each vertex of a lattice or mesh takes what it holds along.

    Gradients: of the volume the exact transpose, of the displacement the derivative inside each tetrahedron; both are
    sums of whole numbers, so they have the same bits on every run, for any number of threads, on the CPU and on CUDA.

    Parameters
    ----------
    volume : Tensor, (N, C, D, H, W)
        Voxels along k, j, i. float32; float64; float16 and bfloat16 are read as float32 and the result is rounded once;
        uint8, int16 and int32 without gradients. On the CPU or on a CUDA device. One field moves all channels.
    displacement : Tensor, (N, 3, d, h, w) or (N, 3, V)
        Deformed minus undeformed place of each vertex, channels x, y, z in LPS mm, axes k, j, i; read as float32. V: the
        vertices of a mesh, or those of a lattice, i fastest, and then those of the mesh that replaces cells of it.
    geometry : Geometry, optional
        Grid of the volume; by default its spacing is 1 mm, so that mm are voxels.
    lattice : int, Geometry, TetrahedralMesh or VertexField
        A vertex on every so many voxels of the volume, straightened (`lattice_shape`); or the grid of the vertices; or a mesh; or a
        lattice with replaced cells, as cuts leave it. The displacements of the last two are not read.
    output : Geometry, optional
        Grid of the result, straight and even; by default that of the volume.
    interpolation : "linear", "nearest", "cubic" or "vote"
        With "nearest" and "cubic" the displacement has no gradient, with "vote" nothing has.
    outside : "refuse", "rest" or "background"
        What becomes of voxels outside the undeformed lattice.
    background : float
        Value where nothing maps; it has no gradient.

    Returns
    -------
    Tensor, (N, C, D', H', W')
        Of the type and device of the volume.

    Raises
    ------
    InputError
        For tensors that do not fit, and fields that are refused.

    Examples
    --------
    >>> volume = torch.rand(1, 1, 9, 9, 9)
    >>> displacement = torch.zeros(1, 3, 3, 3, 3, requires_grad=True)
    >>> moved = deform(volume, displacement, lattice=4)
    >>> bool((moved == volume).all())
    True
    >>> moved.square().sum().backward()
    >>> displacement.grad.shape
    torch.Size([1, 3, 3, 3, 3])
    """
    if volume.dim() != 5:
        raise InputError(f"the volume has the shape {tuple(volume.shape)}; expected (N, C, D, H, W)")
    if volume.dtype not in _READ_AS:
        raise InputError(f"the volume holds {volume.dtype}; expected float32, float64, float16, bfloat16 or whole numbers")
    if not displacement.dtype.is_floating_point:
        raise InputError(f"the displacement holds {displacement.dtype}; expected float32")
    if volume.device != displacement.device:
        raise InputError(f"the volume lies on {volume.device}, the displacement on {displacement.device}")
    of_output: list[float] = []
    straight: Sequence[int] = volume.shape[2:]
    if geometry is not None:
        size = [int(one) for one in _numbers_of(geometry)[2::-1]]
        if size != list(volume.shape[2:]):
            raise InputError(f"the volume has the shape {tuple(volume.shape[2:])}, its geometry {tuple(size)}")
        of_output = list(geometry._straight)
        straight = [int(size) for size in of_output[2::-1]]
    if output is not None:
        of_output = _numbers_of(output)
    numbers: list[float] = []
    rest = tetrahedra = lattice_vertex = replaced = None
    shape: tuple[int, ...]
    if isinstance(lattice, int) and not isinstance(lattice, bool):
        numbers = [float(lattice)]
        shape = lattice_shape(straight, lattice)
    elif isinstance(lattice, Geometry):
        numbers = list(lattice._numbers)
        shape = tuple(int(size) for size in numbers[2::-1])
    elif isinstance(lattice, VertexField) and lattice.mesh is None:
        assert lattice._numbers is not None
        numbers = list(lattice._numbers)
        shape = tuple(int(size) for size in numbers[2::-1])
    elif not isinstance(lattice, (VertexField, TetrahedralMesh)):
        raise TypeError(
            f"lattice is a {type(lattice).__name__}; expected an int, a Geometry, a TetrahedralMesh or a VertexField"
        )
    else:
        held = lattice if isinstance(lattice, VertexField) else VertexField(None, None, lattice)
        rest, tetrahedra, lattice_vertex, replaced, vertices = _tensors_of(held)
        if held.displacement is not None:
            assert held.lattice is not None
            numbers = _numbers_of(held.lattice)
        shape = (vertices,)
    expected = (volume.shape[0], 3, *shape)
    if tuple(displacement.shape) != expected:
        raise InputError(f"the displacement has the shape {tuple(displacement.shape)}; expected {expected}")
    learns = torch.is_grad_enabled()
    if learns and displacement.requires_grad and interpolation != "linear":
        raise InputError(
            f"there is no gradient of the displacement through {interpolation} interpolation; use linear, or detach it"
        )
    if learns and displacement.requires_grad and not volume.dtype.is_floating_point:
        raise InputError(
            f"there is no gradient of the displacement through a volume of {volume.dtype}, whose values are rounded; "
            "convert the volume, or detach the displacement"
        )
    if learns and volume.requires_grad and interpolation == "vote":
        raise InputError("there is no gradient of interpolation by vote, which chooses among labels; detach the volume")
    result: torch.Tensor = torch.ops.tetwarp.deform(
        volume,
        displacement,
        rest,
        tetrahedra,
        lattice_vertex,
        replaced,
        numbers,
        [] if geometry is None else _numbers_of(geometry),
        of_output,
        interpolation,
        outside,
        float(background),
    )
    return result


def clear_cache() -> None:
    """Gives back the memory of what earlier calls left for the next one of the same size."""
    _resamplers.clear()
    _adjoints.clear()


def _numbers_of(geometry: Geometry) -> list[float]:
    if not isinstance(geometry, Geometry):
        raise TypeError(f"a grid is a {type(geometry).__name__}; expected a tetwarp.Geometry")
    return list(geometry._numbers)


def _grid_of(numbers: Sequence[float], shape: Sequence[int]) -> _core.Grid:
    """The grid of numbers; of no numbers that with a spacing of 1 mm and a shape (k, j, i)."""
    if not numbers:
        return Geometry((shape[2], shape[1], shape[0]))._grid
    return _core.Grid(
        [int(size) for size in numbers[:3]], numbers[3:6], numbers[6:9], numbers[9:18], list(numbers[18:])
    )


def _tensors_of(field: VertexField) -> tuple[torch.Tensor, torch.Tensor, Any, Any, int]:
    """The mesh of a field, and how many vertices there are."""
    mesh = field.mesh
    assert mesh is not None
    vertices = len(mesh.rest)
    if field.displacement is not None:
        assert field.lattice is not None
        i, j, k = field.lattice.size
        vertices += i * j * k
    # PyTorch has not all operations of unsigned types; numbers of vertices and cells are below 2^63.
    numbers = [mesh.tetrahedra, mesh.lattice_vertex, field.replaced]
    tensors = [None if one is None else torch.from_numpy(one.astype("int64")) for one in numbers]
    assert tensors[0] is not None
    return torch.from_numpy(mesh.rest), tensors[0], tensors[1], tensors[2], vertices


class _Pool:
    """Resamplers that are not in use, the one that served last at the end: calls of repeated sizes allocate nothing."""

    _MOST = 4

    def __init__(self, kind: Any) -> None:
        self._kind = kind
        self._lock = threading.Lock()
        self._idle: collections.OrderedDict[Any, list[Any]] = collections.OrderedDict()

    @contextlib.contextmanager
    def borrowed(self, output: _core.Grid, device: torch.device) -> Iterator[Any]:
        """One for a grid and a device that nobody else uses meanwhile."""
        threads = _calls.threads(0)
        number = 0
        if device.type == "cuda":
            number = torch.cuda.current_device() if device.index is None else device.index
        key = (Geometry._of(output), device.type, number, threads, _core.is_forked())
        with self._lock:
            idle = self._idle.get(key)
            one = idle.pop() if idle else None
        if one is None:
            one = self._make(output, device.type, number, threads)
        yield one  # one that failed is not used again
        with self._lock:
            self._idle.setdefault(key, []).append(one)
            self._idle.move_to_end(key)
            while sum(len(list_) for list_ in self._idle.values()) > self._MOST:
                oldest = next(iter(self._idle))
                if self._idle[oldest]:
                    self._idle[oldest].pop(0)
                if not self._idle[oldest]:
                    del self._idle[oldest]

    def _make(self, output: _core.Grid, backend: str, number: int, threads: int) -> Any:
        if self._kind is _core.Resampler:
            return _core.Resampler(backend, False, output, number, threads, 0)
        return _core.Adjoint(backend, output, number, threads)

    def clear(self) -> None:
        with self._lock:
            self._idle.clear()

    def begin_in_child(self) -> None:
        """Begins anew in a process that was forked: another thread of the parent may have held the lock.

        What was idle is left as it is: it may hold threads or memory of a device that only the parent has.
        """
        self._of_parent, self._lock, self._idle = self._idle, threading.Lock(), collections.OrderedDict()


_resamplers = _Pool(_core.Resampler)
_adjoints = _Pool(_core.Adjoint)
for _pool in (_resamplers, _adjoints):
    os.register_at_fork(after_in_child=_pool.begin_in_child)


def _exchanged(tensor: torch.Tensor, stream: int) -> Any:
    """A tensor as the binding takes it, its work ordered on a stream."""
    tensor = tensor.detach()
    return tensor.numpy() if tensor.device.type == "cpu" else _arrays.exchanged(tensor, stream)


class _Call:
    """What the forward and the backward pass of a call have in common: grids, fields and the stream."""

    def __init__(
        self,
        shape: Sequence[int],
        displacement: torch.Tensor,
        rest: torch.Tensor | None,
        tetrahedra: torch.Tensor | None,
        lattice_vertex: torch.Tensor | None,
        replaced: torch.Tensor | None,
        lattice: Sequence[float],
        geometry: Sequence[float],
        output: Sequence[float],
        interpolation: str,
        outside: str,
    ) -> None:
        self.geometry = _grid_of(geometry, shape)
        self.output = _grid_of(output, shape) if output else self.geometry.straightened()
        i, j, k = self.geometry.size
        if (k, j, i) != tuple(shape):
            raise InputError(f"the volume has the shape {tuple(shape)}, its geometry {(k, j, i)}")
        self.lattice = None
        if len(lattice) == 1:
            self.lattice = self.geometry.lattice(int(lattice[0]))
        elif lattice:
            self.lattice = _grid_of(lattice, ())
        self._displacement = displacement
        self.mesh: tuple[Any, ...] | None = None
        if rest is not None and tetrahedra is not None:
            self.mesh = (
                rest.cpu().numpy(),
                tetrahedra.cpu().numpy().astype("uint32"),
                None if lattice_vertex is None else lattice_vertex.cpu().numpy(),
            )
        self._replaced = None if replaced is None else replaced.cpu().numpy().astype("uint64")
        self.interpolation = interpolation
        self.outside = outside
        self.stream = 0
        if displacement.device.type == "cuda":
            self.stream = int(torch.cuda.current_stream(displacement.device).cuda_stream)
        self.options = _calls.options(False, "deform", self.stream)

    def set_field(self, core: Any, sample: int, *extra: Any) -> None:
        """Gives a resampler the field of a sample, which is kept until the next one."""
        values = self._displacement[sample].to(torch.float32).flatten(1).t().contiguous()  # (V, 3)
        of_lattice, mesh = None, None
        if self.lattice is not None:
            i, j, k = self.lattice.size
            count = i * j * k
            if len(values) < count or (self.mesh is None and len(values) > count):
                raise InputError(f"the displacement has {len(values)} vertices, the lattice {count}")
            of_lattice, values = values[:count].view(k, j, i, 3), values[count:]
        if self.mesh is not None:
            rest, tetrahedra, lattice_vertex = self.mesh
            mesh = _core.MeshArrays(rest, values.cpu().numpy(), tetrahedra, lattice_vertex)
        displacement = None if of_lattice is None else _exchanged(of_lattice, self.stream)
        core.set_field(self.lattice, displacement, mesh, self._replaced, self.outside, *extra, self.options)


def _forward(volume: Any, displacement: Any, *rest: Any) -> Any:
    *field, background = rest
    call = _Call(volume.shape[2:], displacement, *field)
    values = volume.to(_READ_AS[volume.dtype]).contiguous()
    i, j, k = call.output.size
    result = torch.empty((*volume.shape[:2], k, j, i), dtype=values.dtype, device=values.device)
    with _resamplers.borrowed(call.output, values.device) as core:
        for sample in range(volume.shape[0]):
            call.set_field(core, sample, False)
            targets = [
                _core.Target(
                    _exchanged(values[sample, channel], call.stream),
                    call.geometry,
                    _exchanged(result[sample, channel], call.stream),
                    call.interpolation,
                    background,
                    None,
                )
                for channel in range(volume.shape[1])
            ]
            core.resample(targets, {}, None, call.options)
    return result.to(volume.dtype)


def _gradients(
    gradient: Any, volume: Any, shape: Any, of_volume: Any, of_displacement: Any, displacement: Any, *field: Any
) -> Any:
    call = _Call(shape, displacement, *field)
    samples, channels = gradient.shape[:2]
    kind = _READ_AS[gradient.dtype]

    def voxels(batch: Any, sample: int) -> Any:  # [k, j, i, c], of one channel [k, j, i]
        one = batch[sample].to(kind)
        return one[0].contiguous() if channels == 1 else one.permute(1, 2, 3, 0).contiguous()

    volume_gradient = gradient.new_empty((samples, channels, *shape) if of_volume else (0,))
    displacement_gradient = torch.empty_like(displacement) if of_displacement else displacement.new_empty((0,))
    if channels == 0:
        return volume_gradient, displacement_gradient.zero_()
    made = gradient.new_empty((*shape, channels) if channels > 1 else tuple(shape), dtype=kind) if of_volume else None
    moved = None
    if of_displacement:
        vertices = displacement[0].numel() // 3 if samples else 0
        moved = displacement.new_empty((vertices, 3), dtype=torch.float32)
    with _adjoints.borrowed(call.output, gradient.device) as core:
        for sample in range(samples):
            call.set_field(core, sample)
            given = voxels(gradient, sample)
            source = voxels(volume, sample) if of_displacement else None
            target = _core.AdjointTarget(
                None if source is None else _exchanged(source, call.stream),
                call.geometry,
                _exchanged(given, call.stream),
                None if made is None else _exchanged(made, call.stream),
                call.interpolation,
            )
            core.apply([target], None if moved is None else _exchanged(moved, call.stream), call.options)
            if made is not None:
                volume_gradient[sample] = made if channels == 1 else made.permute(3, 0, 1, 2)
            if moved is not None:
                displacement_gradient[sample] = moved.t().reshape(displacement.shape[1:])
    return volume_gradient, displacement_gradient


def _forward_like(volume: Any, displacement: Any, *rest: Any) -> Any:
    output = rest[6]
    shape = tuple(int(size) for size in output[2::-1]) if output else tuple(volume.shape[2:])
    return volume.new_empty((*volume.shape[:2], *shape))


def _gradients_like(
    gradient: Any, volume: Any, shape: Any, of_volume: Any, of_displacement: Any, displacement: Any, *field: Any
) -> Any:
    samples, channels = gradient.shape[:2]
    return (
        gradient.new_empty((samples, channels, *shape) if of_volume else (0,)),
        torch.empty_like(displacement) if of_displacement else displacement.new_empty((0,)),
    )


def _setup_context(ctx: Any, inputs: Any, output: Any) -> None:
    volume, displacement, rest, tetrahedra, lattice_vertex, replaced, *ctx.field, _ = inputs
    ctx.shape = volume.shape[2:]
    needs_voxels = ctx.needs_input_grad[1]
    ctx.save_for_backward(
        volume if needs_voxels else None, displacement, rest, tetrahedra, lattice_vertex, replaced
    )


def _backward(ctx: Any, gradient: Any) -> Any:
    volume, *field = ctx.saved_tensors
    of_volume, of_displacement = ctx.needs_input_grad[:2]
    volume_gradient, displacement_gradient = torch.ops.tetwarp.deform_backward(
        gradient, volume, ctx.shape, of_volume, of_displacement, *field, *ctx.field
    )
    none = (None,) * 10
    return (volume_gradient if of_volume else None, displacement_gradient if of_displacement else None, *none)


def _folded(tensor: Any, at: int | None, batch: int) -> Any:
    """A tensor (N, ...) of each of a batch, as (batch N, ...)."""
    tensor = tensor.unsqueeze(0).expand(batch, *tensor.shape) if at is None else tensor.movedim(at, 0)
    return tensor.flatten(0, 1)


def _vmap(info: Any, in_dims: Any, volume: Any, displacement: Any, *rest: Any) -> Any:
    batch = info.batch_size
    result = torch.ops.tetwarp.deform(
        _folded(volume, in_dims[0], batch), _folded(displacement, in_dims[1], batch), *rest
    )
    return result.unflatten(0, (batch, -1)), 0


def _vmap_backward(info: Any, in_dims: Any, gradient: Any, volume: Any, *rest: Any) -> Any:
    batch = info.batch_size
    shape, of_volume, of_displacement, displacement, *field = rest
    results = torch.ops.tetwarp.deform_backward(
        _folded(gradient, in_dims[0], batch),
        None if volume is None else _folded(volume, in_dims[1], batch),
        shape,
        of_volume,
        of_displacement,
        _folded(displacement, in_dims[5], batch),
        *field,
    )
    wanted = (of_volume, of_displacement)
    return (
        tuple(one.unflatten(0, (batch, -1)) if want else one for one, want in zip(results, wanted)),
        tuple(0 if want else None for want in wanted),
    )


_deform = torch.library.custom_op(
    "tetwarp::deform", _forward, mutates_args=(), schema=f"(Tensor volume, {_FIELD}, float background) -> Tensor"
)
_deform_backward = torch.library.custom_op(
    "tetwarp::deform_backward",
    _gradients,
    mutates_args=(),
    schema=f"(Tensor gradient, Tensor? volume, int[] shape, bool of_volume, bool of_displacement, {_FIELD}) "
    "-> (Tensor, Tensor)",
)
_deform.register_fake(_forward_like)
_deform_backward.register_fake(_gradients_like)
_deform.register_autograd(_backward, setup_context=_setup_context)
if hasattr(_deform, "register_vmap"):  # PyTorch 2.5 or later
    _deform.register_vmap(_vmap)
    _deform_backward.register_vmap(_vmap_backward)
