# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Simulations: ChainMail and mass-spring from a page of scenario."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import tempfile
from collections.abc import Iterator, Mapping
from typing import Any, Union

import numpy as np

from . import _calls, _core, adapters
from .errors import InputError
from .field import VertexField

Scenario = Union[str, "os.PathLike[str]", Mapping[str, Any]]


@dataclasses.dataclass
class Frame:
    """One step of a scenario."""

    #: From 1, counted over all phases.
    number: int
    #: Name of the phase.
    phase: str
    #: Whether it is the last frame of its phase.
    ends_phase: bool
    #: Steps of the simulation until it converged.
    steps: int
    #: Largest motion of a node in the last step, mm.
    motion_mm: float
    #: Largest net force on a free node, relative; 0 for ChainMail.
    residual: float
    #: Whether it converged within the rule.
    converged: bool
    #: The field after this frame, which later frames do not change. A simulation on CUDA leaves its displacement there,
    #: unless open cuts divide cells: it gives itself by DLPack, and `numpy.asarray` copies it.
    field: VertexField


class Run:
    """A scenario that is played on a volume. Iterating simulates frame by frame.

    Attributes
    ----------
    frames : int
        Number of frames.
    backend : str
        "cpu" or "cuda".
    """

    def __init__(self, core: _core.Run) -> None:
        self._core = core
        self.frames: int = core.frames
        self.backend: str = core.backend

    def __iter__(self) -> Iterator[Frame]:
        while not self._core.is_done:
            yield self.step()

    def step(self, *, progress: _calls.Progress = False) -> Frame:
        """Simulates the next frame. Raises StopIteration after the last."""
        if self._core.is_done:
            raise StopIteration
        number, phase, ends, steps, motion, residual, converged = self._core.next(_calls.options(progress, "simulate"))
        return Frame(
            number, self._core.phase_name(phase), ends, steps, motion, residual, converged, VertexField._of(self._core.field())
        )

    @property
    def field(self) -> VertexField:
        """The field after the last frame of the scenario; simulates what is left."""
        while not self._core.is_done:
            self._core.next(_calls.options(False, "simulate"))
        return VertexField._of(self._core.field())


@contextlib.contextmanager
def scenario_file(scenario: Scenario) -> Iterator[str]:
    """A file with a scenario, which goes with the block unless it was there before."""
    if not isinstance(scenario, Mapping):
        yield os.fspath(scenario)
        return
    with tempfile.TemporaryDirectory(prefix="tetwarp-") as folder:
        path = os.path.join(folder, "scenario.json")
        with open(path, "w", encoding="utf-8") as file:
            json.dump(scenario, file, indent=1)
        yield path


def simulate(
    scenario: Scenario,
    volume: Any,
    *,
    labels: Any = None,
    backend: str = "auto",
    device: int = 0,
    threads: int = 0,
    progress: _calls.Progress = False,
) -> Run:
    """Plays a scenario on a CT.

    Parameters
    ----------
    scenario : path, or dict
        A page of scenario, a JSON file or what stands in one (docs/reference/scenario.md).
    volume : Volume or image
        CT in HU.
    labels : Volume or image, optional
        Labels on the same grid, for tissues by label.

    Returns
    -------
    Run

    Raises
    ------
    InputError
        For a page that is no scenario, or one that cannot be played on this volume.

    Examples
    --------
    >>> import tetwarp as tw
    >>> page = {
    ...     "name": "push", "method": "chainmail", "cell_size": 4,
    ...     "tissues": [{"name": "all", "compression": 0.2, "stretch": 0.2, "shear": 0.2}],
    ...     "hold": [{"border": True}],
    ...     "phases": [{"frames": 2, "move": [
    ...         {"handle": {"at": {"body": [0.5, 0.5, 0.5]}, "radius_mm": 20}, "by_mm": [0, -15, 0]}]}],
    ... }
    >>> run = tw.simulate(page, tw.phantom((32, 32, 16), spacing=(10, 10, 15)), backend="cpu")
    >>> [frame.number for frame in run]
    [1, 2]
    """
    ct, _ = adapters.volume_of(volume)
    labelled = None if labels is None else adapters.volume_of(labels, name="labels")[0]
    for one, name in ((ct, "the volume"), (labelled, "the labels")):
        if one is not None and not isinstance(one.array, np.ndarray):
            raise InputError(f"{name} lies on a device; a simulation examines it in host memory")
    arguments = (
        ct.array,
        ct.geometry._grid,
        None if labelled is None else labelled.array,
        None if labelled is None else labelled.geometry._grid,
        backend,
        _calls.whole(device, "device", 0, 1024),
        _calls.threads(threads),
        _calls.options(progress, "examine"),
    )
    with scenario_file(scenario) as path:
        return Run(_core.Run(path, *arguments))
