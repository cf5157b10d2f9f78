# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What the tests share."""

import os
import pathlib
import signal
import subprocess

import pytest
import tetwarp as tw


# A shell that starts a program in the background has it ignore Ctrl-C, and so would the interpreters that tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def program():
    """Runs the program tetwarp of the same build; TETWARP_PROGRAM names it."""
    path = os.environ.get("TETWARP_PROGRAM", "")
    if not pathlib.Path(path).is_file():
        pytest.skip("TETWARP_PROGRAM names no program to compare with")

    def run(*arguments):
        result = subprocess.run([path, *map(str, arguments)], capture_output=True, text=True, check=False)
        assert result.returncode == 0, result.stderr
        return result

    return run


@pytest.fixture(scope="session")
def ct():
    """A small body, anisotropic, away from the origin."""
    return tw.phantom((40, 36, 20), spacing=(9.0, 9.5, 16.0))


@pytest.fixture(scope="session")
def ct_file(ct, tmp_path_factory):
    path = tmp_path_factory.mktemp("ct") / "ct.mha"
    tw.write(ct, path)
    return path


@pytest.fixture(params=["cpu", "cuda"])
def backend(request):
    """Every backend that is built in; those without a device skip."""
    if request.param == "cuda" and not tw.features()["devices"]:
        pytest.skip("no CUDA device")
    return request.param
