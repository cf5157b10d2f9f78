#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Executes the notebooks in a temporary folder, and fails where a cell fails.

    run.py [FILE...] [--keep FOLDER]

Without FILE: all of this folder. FOLDER receives each as .ipynb with its results. Needs jupytext, nbclient, ipykernel
and matplotlib, and the package tetwarp, in the Python that runs this script; ends with 77 where jupytext or nbclient is
missing.
"""
import argparse
import os
import pathlib
import sys
import tempfile
import time

try:
    import jupytext
    import nbformat
    from jupyter_client import AsyncKernelManager
    from nbclient import NotebookClient
    from nbclient.exceptions import CellExecutionError
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)


def execute(path, keep, timeout_s):
    """Whether all cells of a notebook run."""
    notebook = jupytext.read(path)
    manager = AsyncKernelManager()
    # The Python of this script, whatever kernels are installed for others.
    manager.kernel_spec.argv = [sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    begun = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="tetwarp-notebook-") as scratch:
        client = NotebookClient(
            notebook, km=manager, timeout=timeout_s, resources={"metadata": {"path": scratch}}
        )
        try:
            client.execute(cleanup_kc=True)  # the manager is ours, and would be left running
            failure = None
        except CellExecutionError as error:
            failure = error
    print(f"{'failed' if failure else 'good'}: {path.name}, {time.monotonic() - begun:.1f} s", flush=True)
    if failure:
        print(failure, file=sys.stderr)
    if keep:
        keep.mkdir(parents=True, exist_ok=True)
        nbformat.write(notebook, keep / f"{path.stem}.ipynb")
    return failure is None


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("files", nargs="*", type=pathlib.Path, metavar="FILE")
    words.add_argument("--keep", type=pathlib.Path, metavar="FOLDER")
    words.add_argument("--timeout", type=int, default=300, help="seconds for a cell (default: %(default)s)")
    options = words.parse_args()
    os.environ.setdefault("MPLBACKEND", "module://matplotlib_inline.backend_inline")
    files = options.files or sorted(pathlib.Path(__file__).resolve().parent.glob("[0-9]*_*.py"))
    good = [execute(path, options.keep, options.timeout) for path in files]
    sys.exit(0 if good and all(good) else 1)


main()
