# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Batches: a manifest of cases, resumed after a kill, divided among machines."""

from __future__ import annotations

import os
from typing import Any

from ._command import PathLike, run_command


def batch(manifest: PathLike, output: PathLike, **options: Any) -> int:
    """Runs a manifest, as `tetwarp batch MANIFEST -o OUTPUT` does, in a process of its own.

    That process has its own threads, devices and signals, so that a kill, a resume and a run beside it work as for the
    program. Ctrl-C stops it.

    Parameters
    ----------
    manifest : path
        CSV or JSON Lines (docs/reference/batch.md).
    output : path
        Folder of the results.
    **options
        Those of the command line with underscores: `resume=True`, `jobs=4`, `shard="1/2"`, `backend="cpu"`.

    Returns
    -------
    int
        0 if all cases are done, 3 if some failed (`results.jsonl` says which and why).

    Raises
    ------
    InputError
        For a manifest that cannot be used.
    Error
        For a full disk, a device that is missing, and the like.

    Examples
    --------
    >>> import tempfile
    >>> import tetwarp as tw
    >>> try:
    ...     batch("missing.csv", tempfile.mkdtemp() + "/out")
    ... except tw.Error as error:
    ...     print("missing.csv" in str(error))
    True
    """
    return run_command(["batch", os.fspath(manifest), "-o", os.fspath(output)], options)
