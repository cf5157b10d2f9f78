# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Tetwarp: deforms medical volumes, exactly and with the same bits everywhere.

    import tetwarp as tw

    ct = tw.read("study_folder")
    field = tw.fields.elastic(ct.geometry, amplitude=8, spacing=40, seed=7, cell_size=4)
    done = tw.deform(ct, field, maps=("coverage", "jacobian"))
    tw.write(done.volume, "deformed.nii.gz")

Arrays are indexed [k, j, i], i fastest in memory; places are LPS millimetres.
"""

from __future__ import annotations

import os as _os
from typing import Any as _Any

from . import _core, adapters, augmentation, fields
from .batching import batch
from .deforming import Along, Deformed, compose, deform, forward_of, invert, jacobian, move_points
from .errors import Cancelled, DeviceError, Error, InputError, NotCompiled
from .field import PullField, TetrahedralMesh, VertexField
from .files import PHANTOM_LABELS, info, labelled_phantom, phantom, read, read_field, write, write_field
from .geometry import Geometry
from .known_truth import score, truth
from .rendering import render
from .report import Report
from .resampler import PullResampler, Resampler, Target
from .simulation import Frame, Run, simulate
from .viewing import View, view
from .volume import Volume

__version__: str = _core.version()

# A machine without DCMTK has not its data dictionary either; the package brings one.
_core.set_dicom_dictionary(_os.path.join(_os.path.dirname(__file__), "dicom.dic"))

__all__ = [
    "Along",
    "Cancelled",
    "Deformed",
    "DeviceError",
    "Error",
    "Frame",
    "Geometry",
    "InputError",
    "NotCompiled",
    "PHANTOM_LABELS",
    "PullField",
    "PullResampler",
    "Report",
    "Resampler",
    "Run",
    "Target",
    "TetrahedralMesh",
    "VertexField",
    "View",
    "Volume",
    "adapters",
    "augmentation",
    "batch",
    "compose",
    "deform",
    "features",
    "fields",
    "forward_of",
    "info",
    "invert",
    "jacobian",
    "labelled_phantom",
    "move_points",
    "phantom",
    "read",
    "read_field",
    "render",
    "score",
    "simulate",
    "truth",
    "view",
    "write",
    "write_field",
]


def features() -> dict[str, _Any]:
    """What is built in, and what this machine can use.

    Returns
    -------
    dict
        "version", "commit"; "cuda", "dicom", "jpeg2000", "itk_transforms", "viewer", "vtk_xml" as bool; "devices" as a
        list of texts.

    Examples
    --------
    >>> features()["dicom"]
    True
    """
    built: dict[str, _Any] = dict(_core.compiled())
    devices = [_core.describe_device(number) for number in range(_core.device_count())] if built["cuda"] else []
    return {"version": _core.version(), "commit": _core.commit(), **built, "devices": devices}
