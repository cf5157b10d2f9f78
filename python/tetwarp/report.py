# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What happened in a call."""

from __future__ import annotations

import dataclasses
from typing import Any


@dataclasses.dataclass
class Report:
    """Counts of the first volume's voxels, and of the tetrahedra of the whole field."""

    #: Voxels that got a value through the field.
    covered: int = 0
    #: Voxels that got the background.
    uncovered: int = 0
    #: Voxels of which a value did not fit the type and was saturated.
    clamped: int = 0
    #: Voxels that took the value of the nearest one, because padding was among those with weight.
    padded: int = 0
    #: With outside="rest": voxels outside the undeformed lattice onto which a tetrahedron was moved.
    conflicts: int = 0
    #: Tetrahedra that are turned inside out.
    inverted: int = 0
    #: Tetrahedra without volume, which own nothing.
    degenerate: int = 0
    #: Voxels with more than one owner; None unless the map "folds" was made.
    multiply_owned: int | None = None
    #: Smallest and largest Jacobian determinant of the tetrahedra; None of a pull field.
    jacobian_min: float | None = None
    jacobian_max: float | None = None
    #: "cpu" or "cuda".
    backend: str = ""
    #: Arrays that had to be copied because of the layout of the caller's library.
    copies: int = 0
    #: Remarks.
    notes: list[str] = dataclasses.field(default_factory=list)

    def to_dict(self) -> dict[str, Any]:
        """All of it as a dict, for JSON."""
        return dataclasses.asdict(self)
