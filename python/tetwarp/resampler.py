# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Resamplers: one output grid, field after field, any number of volumes at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import _arrays, _calls, _core
from .errors import InputError
from .field import PullField, VertexField, require_forward, require_pull
from .geometry import Geometry
from .report import Report
from .volume import Volume

#: Type of the values, and values a voxel, of each map.
MAPS: dict[str, tuple[type, int]] = {
    "coverage": (np.uint8, 1),
    "inverse": (np.float32, 3),
    "jacobian": (np.float32, 1),
    "folds": (np.uint16, 1),
}


class Target:
    """One volume of a call, and how it goes through the field.

    Parameters
    ----------
    volume : Volume
    interpolation : "linear", "nearest", "cubic" or "vote"
    background : float, optional
        Value where nothing maps; by default that of the volume, else its smallest value.
    out : array, optional
        Takes the result: shape, type and device of what would be made.
    """

    __slots__ = ("background", "interpolation", "out", "volume")

    def __init__(
        self, volume: Volume, interpolation: str = "linear", background: float | None = None, out: Any = None
    ) -> None:
        if not isinstance(volume, Volume):
            raise TypeError(f"the volume is a {type(volume).__name__}; expected a tetwarp.Volume")
        self.volume = volume
        self.interpolation = interpolation
        if background is None:
            background = _arrays.smallest(volume.array) if volume.background is None else volume.background
        self.background = _calls.number(background, "background")
        self.out = out


class _Resampler:
    _pulls = False

    def __init__(
        self,
        geometry: Geometry,
        backend: str = "auto",
        device: int = 0,
        threads: int = 0,
        memory: int | str | None = None,
    ) -> None:
        if not isinstance(geometry, Geometry):
            raise TypeError(f"geometry is a {type(geometry).__name__}; expected a tetwarp.Geometry")
        if not isinstance(backend, str):
            raise TypeError(f"backend is {backend!r}; expected \"auto\", \"cuda\" or \"cpu\"")
        self.geometry = geometry
        self._core = _core.Resampler(
            backend,
            self._pulls,
            geometry._grid,
            _calls.whole(device, "device", 0, 1024),
            _calls.threads(threads),
            _calls.memory_bytes(memory),
        )
        self._is_set = False

    @property
    def backend(self) -> str:
        """Where it runs: "cpu" or "cuda"."""
        return self._core.backend

    def resample(
        self,
        targets: Sequence[Target | Volume],
        *,
        maps: Sequence[str] | Mapping[str, Any] = (),
        region: tuple[Sequence[int], Sequence[int]] | None = None,
        stream: Any = None,
        progress: _calls.Progress = False,
    ) -> tuple[list[Volume], dict[str, Volume], Report]:
        """Sends volumes through the field that is set.

        Parameters
        ----------
        targets : sequence of Target or Volume
            They share the owner and the undeformed place of each voxel; each lies on its own grid.
        maps : names, or a dict of names and arrays that take them
            "coverage" (uint8: 1 where the first volume got a value), "inverse" (float32, [k, j, i, 3]: undeformed minus
            deformed point, LPS mm, NaN where nothing maps), "jacobian" (float32: determinant of the owner's forward
            map), "folds" (uint16: tetrahedra that own the voxel).
        region : ((i, j, k), (i, j, k)), optional
            First voxel, and the one after the last on each axis, of the part to compute. Outputs hold the whole grid.
        stream : int or a stream of a library, optional
            Work is queued there; by default on the current stream of the first array's library.

        Returns
        -------
        volumes : list of Volume
        maps : dict of Volume
        report : Report

        Raises
        ------
        InputError
            For arrays that do not fit.
        """
        if not self._is_set:
            raise InputError("no field is set; call set_field first")
        wanted = [one if isinstance(one, Target) else Target(one) for one in targets]
        first = wanted[0].volume.array if wanted else np.empty(0)
        number = _arrays.stream_of(first, stream)
        cores: list[_core.Target] = []
        volumes: list[Volume] = []
        for one in wanted:
            array = one.volume.array
            shape = (*self.geometry.shape, *tuple(array.shape)[3:])
            out = one.out
            if out is None:
                out = _arrays.empty_like(array, shape, array.dtype)
                if region is not None:
                    out[...] = _arrays.as_value(one.background, array)
            else:
                out = _arrays.require_result(out, "out")
            result = Volume(out, self.geometry, padding=one.volume.padding)
            result.background = one.background
            result.series = one.volume.series
            volumes.append(result)
            cores.append(
                _core.Target(
                    _arrays.exchanged(array, number),
                    one.volume.geometry._grid,
                    _arrays.exchanged(out, number),
                    one.interpolation,
                    one.background,
                    one.volume.padding,
                )
            )
        given = maps if isinstance(maps, Mapping) else {name: None for name in names_of_maps(maps)}
        made: dict[str, Volume] = {}
        arrays: dict[str, Any] = {}
        for name, array in given.items():
            if name not in MAPS:
                raise InputError(f"there is no map {name!r}; expected {', '.join(map(repr, MAPS))}")
            kind, components = MAPS[name]
            shape = self.geometry.shape if components == 1 else (*self.geometry.shape, components)
            if array is None:
                array = _arrays.empty_like(first, shape, kind)
                if region is not None:
                    array[...] = 0
            else:
                array = _arrays.require_result(array, f"the map {name!r}")
            made[name] = Volume(array, self.geometry)
            arrays[name] = _arrays.exchanged(array, number)
        box = None
        if region is not None:
            corners = _arrays.numbers(region, np.int64, "region")
            if corners.shape != (2, 3) or np.abs(corners).max() > 2**40:
                raise InputError(f"region is {region!r}; expected two corners (i, j, k)")
            box = corners.tolist()
        counts = self._core.resample(cores, arrays, box, _calls.options(progress, "resample", number))
        return volumes, made, Report(**counts, backend=self.backend)


def names_of_maps(maps: Any) -> Sequence[str]:
    """The names of maps, if they are that."""
    if not isinstance(maps, (list, tuple, set, frozenset)) or not all(isinstance(name, str) for name in maps):
        raise TypeError(f"maps is {maps!r}; expected a sequence of names, such as (\"coverage\",)")
    return list(maps)


class Resampler(_Resampler):
    """Sends volumes through forward fields onto one grid.

    Calls of repeated sizes allocate nothing on a device. The result depends on source, field and grid alone: it has the
    same bits on every backend, for any number of threads.

    Parameters
    ----------
    geometry : Geometry
        Grid of the output; straight and even.
    backend : "auto", "cuda" or "cpu"
        "auto": CUDA where a device works, else the CPU.
    device : int
        Number of the CUDA device.
    threads : int
        0: all; one in a worker of PyTorch's DataLoader.
    memory : int or str, optional
        Bytes of device memory for what lies on the host; what does not fit is streamed.

    Examples
    --------
    >>> import tetwarp as tw
    >>> ct = tw.phantom((16, 16, 8))
    >>> warp = Resampler(ct.geometry)
    >>> warp.set_field(tw.fields.translate(ct.geometry, by=(0, 0, 0)))
    >>> volumes, maps, report = warp.resample([ct], maps=["coverage"])
    >>> bool((volumes[0].array == ct.array).all()), report.uncovered
    (True, 0)
    """

    def set_field(
        self,
        field: VertexField,
        *,
        outside: str = "refuse",
        jacobian_range: bool = True,
        stream: Any = None,
        progress: _calls.Progress = False,
    ) -> None:
        """Takes a forward field. It is not copied: its values must not change until the next call.

        Parameters
        ----------
        outside : "refuse", "rest" or "background"
            What becomes of voxels outside the undeformed lattice: the field is refused, they stay, or get the background.
        jacobian_range : bool
            Whether reports state the range of the Jacobian determinant.
        """
        field = require_forward(field, "set it with tetwarp.PullResampler")
        values = _arrays.on_host(field.displacement) if self.backend == "cpu" else field.displacement
        number = _arrays.stream_of(values, stream)
        self._field = field
        self._is_set = False
        displacement = None if values is None else _arrays.exchanged(values, number)
        self._core.set_field(
            None if field.lattice is None else field.lattice._grid,
            displacement,
            None if field.mesh is None else field.mesh._core(),
            field.replaced,
            outside,
            bool(jacobian_range),
            _calls.options(progress, "field", number),
        )
        self._is_set = True

    def check(self, *, progress: _calls.Progress = False) -> dict[str, Any]:
        """What the field that is set is like: stretch, shares of Jacobian determinants, and how well forward and inverse
        undo each other, mm."""
        if not self._is_set:
            raise InputError("no field is set; call set_field first")
        return dict(self._core.check(self._field._host(), _calls.options(progress, "check")))


class PullResampler(_Resampler):
    """Sends volumes through pull fields onto one grid; for the rest as `Resampler`.

    Examples
    --------
    >>> import tetwarp as tw
    >>> ct = tw.phantom((16, 16, 8))
    >>> warp = PullResampler(ct.geometry)
    >>> warp.set_field(PullField(ct.geometry, np.zeros((*ct.geometry.shape, 3), np.float32)))
    >>> volumes, _, _ = warp.resample([ct])
    >>> bool((volumes[0].array == ct.array).all())
    True
    """

    _pulls = True

    def set_field(
        self, field: PullField, *, outside: str = "refuse", stream: Any = None, progress: _calls.Progress = False
    ) -> None:
        """Takes a pull field. It is not copied: its values must not change until the next call."""
        field = require_pull(field, "set it with tetwarp.Resampler")
        number = _arrays.stream_of(field.displacement, stream)
        self._field = field
        self._is_set = False
        self._core.set_pull_field(
            field.geometry._grid,
            _arrays.exchanged(field.displacement, number),
            outside,
            _calls.options(progress, "field", number),
        )
        self._is_set = True
