# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Batches: a manifest of cases, resumed after a kill, divided among machines."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from typing import Any, Union

from .errors import Error, InputError

PathLike = Union[str, "os.PathLike[str]"]

_ERRORS: dict[int, type[Error]] = {2: InputError, 4: InputError}


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
    >>> try:
    ...     batch("missing.csv", tempfile.mkdtemp() + "/out")
    ... except Error as error:
    ...     print("missing.csv" in str(error))
    True
    """
    words = ["batch", os.fspath(manifest), "-o", os.fspath(output)]
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if value is True:
            words.append(option)
        elif value is not False and value is not None:
            words.append(f"{option}={value}")
    process = subprocess.Popen(
        [sys.executable, "-m", "tetwarp._program", *words], stderr=subprocess.PIPE, text=True, errors="replace"
    )
    try:
        _, said = process.communicate()
    except BaseException:
        process.send_signal(signal.SIGINT)  # a second one, from a terminal, would end it at once: it then resumes
        process.communicate()
        raise
    if process.returncode in (0, 3):
        return process.returncode
    lines = [line for line in said.splitlines() if line.startswith("tetwarp: error: ")]
    text = lines[-1].removeprefix("tetwarp: error: ") if lines else said.strip()
    raise _ERRORS.get(process.returncode, Error)(text)
