# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Types: what a checker says of the package and of a program that uses it."""

import pathlib
import subprocess
import sys

import pytest
import tetwarp as tw

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGE = pathlib.Path(tw.__file__).parent


def mypy(*arguments):
    pytest.importorskip("mypy")
    return subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--config-file", ROOT / "pyproject.toml", "--cache-dir", "/dev/null",
         *arguments],
        capture_output=True, text=True, check=False, cwd=ROOT,
    )


def test_a_program_of_a_user_type_checks_strictly():
    result = mypy(ROOT / "python" / "tests" / "typed_example.py")
    assert result.returncode == 0, result.stdout


def test_a_wrong_program_does_not(tmp_path):
    wrong = tmp_path / "wrong.py"
    wrong.write_text(
        "import tetwarp as tw\n"
        "ct = tw.read('a')\n"
        "tw.deform(ct, tw.invert(tw.fields.identity(ct.geometry), ct.geometry))\n"
        "tw.fields.twist(ct.geometry, angel=3)\n"
    )
    said = mypy(wrong).stdout
    assert "wrong.py:3" in said and "wrong.py:4" in said


def test_the_sources_of_the_package_type_check_strictly():
    result = mypy("-p", "tetwarp")
    assert result.returncode == 0, result.stdout


def test_stubs_say_what_the_module_has():
    import inspect
    import re

    core = tw._core
    stub = (PACKAGE / "_core.pyi").read_text()
    said = set(re.findall(r"^(?:def|class) (\w+)", stub, re.M))
    has = {name for name, value in vars(core).items() if not name.startswith("_") and not inspect.ismodule(value)}
    assert said == has
