# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Formulas for fields. Lengths are LPS mm, angles degrees; the centre is that of the volume.

Each gives a `VertexField` on a lattice over a volume's geometry with a vertex on every `cell_size`-th voxel, with the
bits of the program's `-f`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from . import _calls, _core
from .errors import InputError
from .field import VertexField
from .geometry import Geometry

__all__ = ["bubble", "bubble_paper", "elastic", "formula", "identity", "translate", "twist", "wave"]


def _word(value: Any, name: str) -> str:
    if isinstance(value, str):
        if any(character in value for character in ",:=/"):
            raise InputError(f"{name} is {value!r}; expected one value")
        return value
    if isinstance(value, int):
        return str(value)
    return repr(_calls.number(value, name))


def _point(values: Sequence[float], name: str) -> str:
    try:
        words = [_word(value, name) for value in values]
    except TypeError:
        raise InputError(f"{name} is {values!r}; expected three numbers") from None
    if len(words) != 3:
        raise InputError(f"{name} has {len(words)} numbers; expected three")
    return "/".join(words)


def formula(text: str | Sequence[str], geometry: Geometry, *, cell_size: int = 1, threads: int = 0) -> VertexField:
    """A field by the program's text, such as `"wave:amplitude=8,wavelength=64vox"`; of several the first is applied first.

    Parameters
    ----------
    text : str or sequence of str
        Formulas, or names of field files, as `-f` takes them.
    geometry : Geometry
        Grid of the volume that is to be deformed.
    cell_size : int
        A vertex on every `cell_size`-th voxel.

    Raises
    ------
    InputError
        For a text that is no formula and no file, or parameters that are wrong.

    Examples
    --------
    >>> field = formula("translate:by=1/0/0", Geometry((9, 9, 9)), cell_size=4)
    >>> field.displacement[0, 0, 0]
    array([1., 0., 0.], dtype=float32)
    """
    texts = [text] if isinstance(text, str) else list(text)
    if not all(isinstance(one, str) for one in texts):
        raise TypeError(f"text is {text!r}; expected a str or several")
    if not isinstance(geometry, Geometry):
        raise TypeError(f"geometry is a {type(geometry).__name__}; expected a tetwarp.Geometry")
    size = _calls.whole(cell_size, "cell_size", 1, 65536)
    parts, notes = _core.read_forward(
        texts, geometry._grid, size, "sform", _calls.threads(threads), _calls.options(False, "field")
    )
    return VertexField._of(parts, notes)


def identity(geometry: Geometry, *, cell_size: int = 1) -> VertexField:
    """Nothing moves.

    Examples
    --------
    >>> bool(identity(Geometry((4, 4, 4))).displacement.any())
    False
    """
    return formula("identity", geometry, cell_size=cell_size)


def wave(
    geometry: Geometry,
    *,
    amplitude: float | str,
    wavelength: float | str,
    phase: float = 0,
    axis: str = "x",
    along: str = "z",
    cell_size: int = 1,
) -> VertexField:
    """A plane wave of shear: p' = p + A sin(2 pi d.along / L + phase) axis (the paper's Eq. 14).

    Parameters
    ----------
    amplitude, wavelength : float, mm, or str such as "8vox"
    phase : float
        Degrees.
    axis, along : "x", "y" or "z"
        Axis of the displacement, and axis along which the wave runs.

    Examples
    --------
    >>> wave(Geometry((8, 8, 8)), amplitude=2, wavelength=16, cell_size=2).lattice.size
    (5, 5, 5)
    """
    text = (
        f"wave:amplitude={_word(amplitude, 'amplitude')},wavelength={_word(wavelength, 'wavelength')},"
        f"phase={_word(phase, 'phase')},axis={_word(axis, 'axis')},along={_word(along, 'along')}"
    )
    return formula(text, geometry, cell_size=cell_size)


def twist(geometry: Geometry, *, angle: float, axis: str = "z", cell_size: int = 1) -> VertexField:
    """A rotation about an axis through the centre, `angle` degrees at either end (the paper's Eq. 15).

    Examples
    --------
    >>> twist(Geometry((8, 8, 8)), angle=30, cell_size=4).displacement.shape
    (3, 3, 3, 3)
    """
    return formula(f"twist:angle={_word(angle, 'angle')},axis={_word(axis, 'axis')}", geometry, cell_size=cell_size)


def bubble(
    geometry: Geometry,
    *,
    radius: float | str,
    strength: float,
    center: Sequence[float] | None = None,
    cell_size: int = 1,
) -> VertexField:
    """A local swelling: p' = c + (1 + a (1 - r/R)^2) d for r = |d| < R. It does not fold for -1 < a < 3.

    Parameters
    ----------
    radius : float, mm, or str such as "20vox"
    strength : float
        a of the formula.
    center : (float, float, float), optional
        c, LPS mm; the middle of the volume by default.

    Examples
    --------
    >>> field = bubble(Geometry((9, 9, 9)), radius=3, strength=0.5)
    >>> bool(field.displacement[0].any())
    False
    """
    text = f"bubble:radius={_word(radius, 'radius')},strength={_word(strength, 'strength')}"
    if center is not None:
        text += f",center={_point(center, 'center')}"
    return formula(text, geometry, cell_size=cell_size)


def bubble_paper(
    geometry: Geometry, *, shift: float | str, center: Sequence[float] | None = None, cell_size: int = 1
) -> VertexField:
    """The paper's Eq. 16 as printed. It opens a cavity of radius `shift` for a shift above 0, and folds below.

    Examples
    --------
    >>> bubble_paper(Geometry((5, 5, 5)), shift=1).displacement.shape
    (5, 5, 5, 3)
    """
    text = f"bubble-paper:shift={_word(shift, 'shift')}"
    if center is not None:
        text += f",center={_point(center, 'center')}"
    return formula(text, geometry, cell_size=cell_size)


def elastic(
    geometry: Geometry, *, amplitude: float | str, spacing: float | str, seed: int, cell_size: int = 1
) -> VertexField:
    """A smooth random field of cubic B-splines. It is the same on every machine, for any lattice.

    Parameters
    ----------
    amplitude : float, mm, or str
        No component of a displacement exceeds it. The map does not fold below spacing / 2.48.
    spacing : float, mm, or str
        Distance of control points.
    seed : int
        Decides the field.

    Examples
    --------
    >>> field = elastic(Geometry((16, 16, 16)), amplitude=2, spacing=8, seed=7, cell_size=4)
    >>> float(abs(field.displacement).max()) <= 2
    True
    """
    seed = _calls.whole(seed, "seed", 0, 2**64 - 1)
    text = f"elastic:amplitude={_word(amplitude, 'amplitude')},spacing={_word(spacing, 'spacing')},seed={seed}"
    return formula(text, geometry, cell_size=cell_size)


def translate(geometry: Geometry, *, by: Sequence[float], cell_size: int = 1) -> VertexField:
    """A shift of everything by (x, y, z), LPS mm.

    Examples
    --------
    >>> translate(Geometry((2, 2, 2)), by=(0, 0, 3)).displacement[1, 1, 1]
    array([0., 0., 3.], dtype=float32)
    """
    return formula(f"translate:by={_point(by, 'by')}", geometry, cell_size=cell_size)
