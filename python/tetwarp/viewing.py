# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""The viewer: a page in the browser, in which tissue is taken hold of and pulled."""

from __future__ import annotations

import atexit
import dataclasses
import html
import json
import os
import sys
import threading
import weakref
from typing import Any

import numpy as np

from . import _arrays, _calls, _core, adapters
from .deforming import deform
from .errors import Error, InputError
from .field import VertexField
from .files import write, write_field
from .simulation import Scenario, scenario_file, simulate
from .volume import Volume

_FRAME_HEIGHT = 760  # pixels on the screen


@dataclasses.dataclass
class _Saving:
    """Writes what a page wishes into one folder."""

    volume: Volume
    labels: Volume | None
    folder: str
    #: Suffixes of files, and "dicom" for a series.
    kinds: list[str]
    backend: str
    device: int
    threads: int

    def save(
        self, name: str, kind: str, scenario: str, field: bool, pictures: dict[str, bytes]
    ) -> tuple[list[str], str]:
        """Writes a scenario, the volume if a kind is named, the field and pictures. Returns the files, and the lines that
        make volume and field again."""
        stem = os.path.join(self.folder, name)
        page = stem + ".json"
        output = stem + ("-dicom" if kind == "dicom" else kind or ".nii.gz")
        cuts = bool(scenario) and bool(json.loads(scenario).get("cuts"))
        field_file = f"{stem}-field.{'vtk' if cuts else 'mha'}"
        png = {f"{stem}-{pane}.png": picture for pane, picture in pictures.items()}
        for path in (*([output] if kind else []), *([field_file] if field else []), *png):
            if os.path.lexists(path):
                raise InputError(f"{path} exists; take another name")
        os.makedirs(self.folder, exist_ok=True)
        files = []
        for path, content in ((page, scenario.encode()), *png.items()):
            if content:
                _core.write_bytes(path, content)
                files.append(path)
        if not scenario:
            return files, ""
        labels = "" if self.labels is None else ", labels=labels"
        lines = ["import tetwarp as tw", f"run = tw.simulate({page!r}, volume{labels})"]
        where: dict[str, Any] = {"backend": self.backend, "device": self.device, "threads": self.threads}
        run = simulate(page, self.volume, labels=self.labels, **where) if kind or field else None
        if run is not None and kind:
            write(deform(self.volume, run.field, **where).volume, output, threads=self.threads)
            files.append(output)
        lines.append(f"tw.write(tw.deform(volume, run.field).volume, {output!r})")
        if run is not None and field:
            write_field(run.field, field_file)
            files.append(field_file)
            lines.append(f"tw.write_field(run.field, {field_file!r})")
        return files, "\n".join(lines)


def _save_wishes(core: Any, saving: _Saving) -> None:
    """Does what the page wishes, one after the other, until the viewer ends."""
    while (wish := core.next_wish()) is not None:
        try:
            files, command = saving.save(*wish)
            core.answer(files, command, "")
        except Exception as error:
            core.answer([], "", str(error) or type(error).__name__)


def _end(core: Any, thread: threading.Thread, process: int) -> None:
    """Ends a viewer; what is being written is finished. A process that was forked has not its threads."""
    if os.getpid() != process:
        return
    core.stop()
    try:
        if thread is not threading.current_thread():
            thread.join()
    finally:
        core.close()


def _in_notebook() -> bool:
    """Whether this is the kernel of a notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return getattr(shell, "kernel", None) is not None


class View:
    """A viewer at work. `view` makes it.

    It ends with `close`, at the end of a `with` block, when nobody refers to it any more, or with Python. Field, scenario
    and number of frames stay what they were when it was closed.
    """

    def __init__(self, core: Any, saving: _Saving, *, iframe: bool) -> None:
        self._core = core
        self._iframe = iframe
        self._lock = threading.RLock()
        self._closed = threading.Event()
        self._last: tuple[Any, str, int] | None = None
        self._port: int = core.port
        self._url: str = core.address
        self._thread = threading.Thread(target=_save_wishes, args=(core, saving), name="tetwarp-view", daemon=True)
        self._thread.start()
        self._process = os.getpid()
        self._end = weakref.finalize(self, _end, core, self._thread, self._process)
        self._end.atexit = False  # `_close_all` does it
        _open_views.add(self)
        far = _core.came_by_ssh() or (_in_notebook() and not _core.has_desktop())
        self._ssh: str | None = _core.forwarding_command(self._port) if far else None

    @property
    def url(self) -> str:
        """Where the page is, with the secret that lets it in. With `iframe=True` each address works once, and this is
        one that has not been used."""
        with self._lock:
            if self._is_open():
                self._url = self._core.address
            return self._url

    @property
    def ssh(self) -> str | None:
        """The command that makes the page reachable from the machine at which you sit, if this is another one."""
        return self._ssh

    @property
    def field(self) -> VertexField:
        """The field as it is now, a copy."""
        return VertexField._of(self._done(True, False)[0])

    @property
    def scenario(self) -> dict[str, Any] | None:
        """What was done so far, as `simulate` takes it; None where nothing was."""
        text = self._done(False, True)[1]
        return dict(json.loads(text)) if text else None

    @property
    def frames(self) -> int:
        """Number of frames that were simulated and not taken back."""
        return self._done(False, False)[2]

    def _done(self, field: bool, scenario: bool) -> tuple[Any, str, int]:
        if os.getpid() != self._process:
            raise Error("the viewer works in the process that made it, not in one that was forked from it")
        with self._lock:
            if self._end.alive:
                done: tuple[Any, str, int] = self._core.done(field, scenario)
                return done
            if self._last is None:
                raise Error("the viewer ended before it could say what was done")
            return self._last

    def _is_open(self) -> bool:
        return self._end.alive and os.getpid() == self._process

    def close(self) -> None:
        """Ends it. What is being written is finished."""
        if not self._is_open():
            return
        with self._lock:
            if self._is_open() and self._last is None:
                try:
                    self._last = self._core.done(True, True)
                finally:
                    self._end.detach()  # calling it does nothing when Python ends
                    _end(self._core, self._thread, self._process)
                    self._closed.set()

    def wait(self) -> None:
        """Waits until it is closed. Ctrl-C closes it."""
        try:
            self._closed.wait()
        except KeyboardInterrupt:
            self.close()

    def __enter__(self) -> View:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<View on port {self._port}{'' if self._is_open() else ', closed'}>"

    def _repr_html_(self) -> str | None:
        if not self._iframe or not self._is_open():
            return None
        return (
            f'<iframe src="{html.escape(self.url)}" title="Tetwarp" width="100%" height="{_FRAME_HEIGHT}" '
            'style="border: 0" allow="fullscreen"></iframe>'
        )


_open_views: weakref.WeakSet[View] = weakref.WeakSet()


@atexit.register
def _close_all() -> None:
    """Closes what a program forgot to close."""
    for one in list(_open_views):
        one.close()


def view(
    volume: Any,
    *,
    scenario: Scenario | None = None,
    labels: Any = None,
    cell_size: int | None = None,
    backend: str = "auto",
    device: int = 0,
    threads: int = 0,
    folder: str | os.PathLike[str] = "tetwarp-view",
    port: int = 0,
    open: bool | None = None,
    iframe: bool = False,
) -> View:
    """Shows a CT in the browser, where tissue is taken hold of and pulled, pinned, cut and pushed.

    The page is served by this process to this machine alone, and works beside what Python does (docs/guide/view.md).

    Parameters
    ----------
    volume : Volume or image
        CT in HU. It must not change meanwhile.
    scenario : path, or dict, optional
        Tissues, method, what is held and cuts, and phases that a button plays.
    labels : Volume or image, optional
        Labels on the same grid, for tissues by label.
    cell_size : int, optional
        Distance of lattice vertices, voxels; by default that of the scenario, or as many as can be simulated in time.
    folder : path
        Takes what the page saves; made when the first file is.
    port : int
        Port on this machine; 0: one that is free.
    open : bool, optional
        Whether a browser is opened. By default it is, unless you came by ssh. Where none could be opened, the address is
        printed, and on a far machine the command of ssh that makes it reachable. False: nothing is opened or printed.
    iframe : bool
        For notebooks: the object shows itself as a frame with the page. Pages of this machine alone may frame it.

    Returns
    -------
    View

    Raises
    ------
    InputError
        For a volume with several values a voxel, or on a device; a scenario that cannot be played on it.
    TypeError
        For what is no volume.
    Error
        For a port that is taken.
    NotCompiled
        In a build without the viewer; see `features`.

    Examples
    --------
    >>> import tetwarp as tw
    >>> with tw.view(tw.phantom((32, 32, 16), spacing=(10, 10, 15)), backend="cpu", open=False) as shown:
    ...     shown.url.startswith("http://127.0.0.1:"), shown.frames
    (True, 0)
    """
    ct, _ = adapters.volume_of(volume)
    labelled = None if labels is None else adapters.volume_of(labels, name="labels")[0]
    for one, name in ((ct, "the volume"), (labelled, "the labels")):
        if one is not None and not isinstance(one.array, np.ndarray):
            raise InputError(f"{name} lies on a device; the viewer takes it in host memory")
    saving = _Saving(
        ct,
        labelled,
        os.path.abspath(os.fspath(folder)),
        [*(["dicom"] if ct.series is not None else []), ".nii.gz", ".mha", ".nrrd"],
        backend,
        _calls.whole(device, "device", 0, 1024),
        _calls.threads(threads),
    )
    for choice, name in ((open, "open"), (iframe, "iframe")):
        if not isinstance(choice, bool) and (name == "iframe" or choice is not None):
            raise InputError(f"{name} is {choice!r}; expected True or False")
    place: tuple[Any, ...] = (saving.kinds, os.fspath(folder), _calls.whole(port, "port", 0, 65535), iframe)
    background = _arrays.smallest(ct.array) if ct.background is None else ct.background
    cells = None if cell_size is None else _calls.whole(cell_size, "cell_size", 1, 4096)
    core = _started(ct, labelled, scenario, (float(background), ct.padding), cells, place, saving)
    shown = View(core, saving, iframe=iframe)
    if open is not False:
        _show(shown, opens=not iframe and (open is True or shown.ssh is None))
    return shown


def _started(
    ct: Volume,
    labels: Volume | None,
    scenario: Scenario | None,
    values: tuple[float, tuple[float, float] | None],
    cell_size: int | None,
    place: tuple[Any, ...],
    saving: _Saving,
) -> Any:
    """The viewer of the binding, which serves from now on."""
    make: Any = _core.Viewer  # in a build without the viewer it only raises NotCompiled
    if not _core.compiled()["viewer"]:
        make()

    def with_scenario(path: str | None) -> Any:
        return make(
            ct.array,
            ct.geometry._grid,
            None if labels is None else labels.array,
            None if labels is None else labels.geometry._grid,
            _core.ViewInput(*values, path, cell_size),
            _core.ViewPlace(*place),
            saving.backend,
            saving.device,
            saving.threads,
            _calls.options(False, "view"),
        )

    if scenario is None:
        return with_scenario(None)
    with scenario_file(scenario) as path:
        return with_scenario(path)


def _show(shown: View, *, opens: bool) -> None:
    """Opens a browser; or says where the page is and, on a far machine, how to reach it."""
    is_open = opens and shown._core.open()
    if not is_open and not shown._iframe:
        print(shown.url)
    if shown.ssh is not None:
        print(f"from your own machine: {shown.ssh}{'' if shown._iframe else ', then open the address there'}")
