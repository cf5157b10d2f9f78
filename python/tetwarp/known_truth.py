# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Sets of deformations whose truth is known, and how far registrations of them are off."""

from __future__ import annotations

import json
import numbers
import operator
import os
import pathlib
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ._command import PathLike, run_command


def truth(
    volume: PathLike,
    output: PathLike,
    *,
    cases: str | Sequence[str] = (),
    labels: PathLike | None = None,
    roles: Mapping[str, int | Iterable[int]] | None = None,
    **options: Any,
) -> None:
    """Makes a set of deformed volumes whose truth is known, as `tetwarp truth` does, in a process of its own.

    Parameters
    ----------
    volume : path
        A CT in HU, a file or a folder of DICOM: the moving volume. Or a manifest, which makes a set of each of its rows.
    output : path
        Folder of the set; it must be empty or not there.
    cases : str or sequence of str
        Deformations, KIND[:KEY=VALUE,...]; by default elastic ones of five strengths, shift, rotation, and each kind whose
        labels are known (docs/guide/truth.md).
    labels : path, optional
        Labels on the grid of the volume; they go along.
    roles : mapping, optional
        Which labels are what a kind needs: `{"lung": 2, "bone": [3, 17]}`.
    **options
        Those of the command line with underscores: `noise=12` or `noise="measured"`, `dose="dose.dcm"`, `cell_size=4`,
        `dense=True`, `resume=True`.

    Raises
    ------
    InputError
        For a volume, labels or cases that cannot be used.
    Error
        For a folder that is there, a full disk, and the like.

    Examples
    --------
    >>> import tempfile
    >>> import tetwarp as tw
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> tw.write(tw.phantom((40, 40, 30), spacing=(10, 10, 10), noise_hu=0), folder / "ct.nii.gz")
    >>> truth(folder / "ct.nii.gz", folder / "set", cases=["shift:x=4"], noise=10, dense=True)
    >>> (folder / "results").mkdir()
    >>> exact = (folder / "set" / "shift-x-4" / "inverse.nii.gz").rename(folder / "results" / "shift-x-4.nii.gz")
    >>> [(one["case"], one["passed"], one["body"]["largest_mm"] < 1e-4) for one in score(folder / "set", folder / "results")]
    [('shift-x-4', True, True)]
    """
    labelled = []
    for role, given in (roles or {}).items():
        all_numbers: Iterable[Any] = [given] if isinstance(given, numbers.Integral) else given  # type: ignore[assignment]
        labelled.append(f"{role}={','.join(str(operator.index(number)) for number in all_numbers)}")
    words = {"case": [cases] if isinstance(cases, str) else list(cases), "labels": labels, "label": labelled, **options}
    run_command(["truth", os.fspath(volume), "-o", os.fspath(output)], words)


def score(
    folder: PathLike,
    results: PathLike | Sequence[PathLike],
    **options: Any,
) -> list[dict[str, Any]]:
    """Says how far registrations of a set are off, as `tetwarp score` does, in a process of its own.

    Parameters
    ----------
    folder : path
        A set that `truth` made.
    results : path, or several
        Folders with a result of each case, named CASE and a suffix: a displacement field or transform from fixed to
        moving, or CASE.csv, the landmarks of the fixed volume taken to the moving one. What files do not say stands behind
        the folder's name: "warps:values=positions,frame=ras".
    **options
        Those of the command line with underscores: `direction="forward"`, `back="other_direction"`, `triples="between"`,
        `limits="limits.json"`, `html="page.html"`, `csv="table.csv"`.

    Returns
    -------
    list of dict
        One for each case and result, as the program writes them as JSON (docs/guide/truth.md): "case", "result", "passed",
        "body", "labels", "near_slip", "from_slip", "landmarks", "jacobian", "dice", "surfaces", "gamma", "inverse_consistency",
        "transitivity", "checks"; "failure" where a result cannot be read.

    Raises
    ------
    InputError
        For a folder that is no set.

    Examples
    --------
    >>> import tempfile
    >>> import tetwarp as tw
    >>> try:
    ...     score(tempfile.mkdtemp(), "results")
    ... except tw.InputError as error:
    ...     print("no complete set" in str(error))
    True
    """
    several = [results] if isinstance(results, (str, os.PathLike)) else list(results)
    with tempfile.TemporaryDirectory(prefix="tetwarp-") as scratch:
        page = options.pop("json", None) or pathlib.Path(scratch) / "scores.json"
        run_command(["score", os.fspath(folder)], {"results": several, "json": page, **options}, silent=True)
        scores: list[dict[str, Any]] = json.loads(pathlib.Path(page).read_text())["scores"]
    return scores
