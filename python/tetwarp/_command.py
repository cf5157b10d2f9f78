# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Commands of the program, each in a process of its own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from typing import Any, Union

from .errors import Error, InputError

PathLike = Union[str, "os.PathLike[str]"]

_ERRORS: dict[int, type[Error]] = {2: InputError, 4: InputError}


def run_command(words: Sequence[str], options: Mapping[str, Any], *, silent: bool = False) -> int:
    """Runs a command. Ctrl-C stops it.

    Parameters
    ----------
    words : sequence of str
        The command and what stands beside its options.
    options : mapping
        Options with underscores; a list repeats an option, True is an option without a value.
    silent : bool
        What it prints on standard output is dropped.

    Returns
    -------
    int
        0 or 3, the exit status.

    Raises
    ------
    InputError, Error
        By the other ones, with the program's own line.
    """
    words = list(words)
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        for one in value if isinstance(value, (list, tuple)) else [value]:
            if one is True:
                words.append(option)
            elif one is not False and one is not None:
                words.append(f"{option}={os.fspath(one) if isinstance(one, os.PathLike) else one}")
    process = subprocess.Popen(
        [sys.executable, "-m", "tetwarp._program", *words],
        stdout=subprocess.DEVNULL if silent else None,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
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
