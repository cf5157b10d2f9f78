# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Types: what a checker says of the package and of a program that uses it."""

import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


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


# What stubtest says of every module of nanobind: its functions and classes are of types of its own.
OF_NANOBIND = re.compile(r"is not a function$|metaclass differs$|is a disjoint base at runtime|\.__init__ is inconsistent, stub does not have \*args")


def test_stubs_agree_with_the_module():
    pytest.importorskip("mypy")
    said = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "tetwarp._core", "--concise", "--mypy-config-file", ROOT / "pyproject.toml"],
        capture_output=True, text=True, check=False, cwd=ROOT,
    )
    lines = said.stdout.splitlines()
    assert len(lines) > 40, said.stdout + said.stderr  # as many functions has the module
    assert [line for line in lines if not OF_NANOBIND.search(line)] == []
