#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""The manual against the program: pages have each command and option, and a shell completes them.

    check_manual.py PROGRAM FOLDER     FOLDER: what tetwarp-manual wrote

A real shell is started on a terminal, a line is typed and Tab is pressed twice. Shells and formatters that are missing
are left out, with a word; bash is asked in any case. Exit status 0: all holds, 1: something does not.
"""
import os
import pathlib
import pty
import re
import select
import shutil
import subprocess
import sys
import tempfile
import time

PATIENCE = 20  # seconds for a shell to answer
FAILURES = []


def expect(holds, what):
    if not holds:
        FAILURES.append(what)
        print("FAILED:", what)


def said(*command):
    return subprocess.run(command, stdout=subprocess.PIPE, check=True, text=True).stdout


def commands_of(program):
    """Names of the commands, from the program's own help."""
    listed = said(program, "--help").split("Subcommands:")[1]
    return re.findall(r"^  ([a-z]+) ", listed, re.MULTILINE)


def check_pages(program, folder):
    commands = commands_of(program)
    expect(len(commands) >= 10, f"ten commands, found {commands}")
    for name in ["tetwarp"] + ["tetwarp-" + command for command in commands]:
        page = folder / "man" / "man1" / f"{name}.1"
        expect(page.is_file(), f"a page {page}")
        text = page.read_text(encoding="utf-8")
        expect(re.match(r"\.TH TETWARP", text) is not None, f"{name}: a heading")
        if name != "tetwarp" and name != "tetwarp-bench":
            options = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", said(program, name[8:], "--help").split("Options:")[1]))
            for option in options:
                expect(option.replace("-", r"\-") in text, f"{name}: {option}")
        if shutil.which("groff"):
            done = subprocess.run(["groff", "-man", "-Tutf8", "-ww", str(page)], capture_output=True, text=True)
            # groff 1.23 says so where a line has no place for a break, such as a list of suffixes.
            warnings = [line for line in done.stderr.splitlines() if "cannot adjust line" not in line]
            expect(done.returncode == 0 and not warnings, f"{name}: groff says {warnings[:2]!r}")
            expect(name in done.stdout, f"{name}: is in what groff prints")
        if shutil.which("mandoc"):
            done = subprocess.run(["mandoc", "-Tlint", "-Werror", str(page)], capture_output=True, text=True)
            expect(done.returncode == 0, f"{name}: mandoc says {done.stdout[:200]!r}")


def press_tab(shell, setup, line, wanted):
    """What a shell prints after Tab was pressed twice behind a line; ends as soon as all of `wanted` has come."""
    environment = {**os.environ, "TERM": "dumb" if shell[0] != "fish" else "xterm", "PS1": "$ ", "HOME": setup["home"]}
    pid, terminal = pty.fork()
    if pid == 0:
        os.chdir(setup["folder"])
        os.execvpe(shell[0], shell, environment)
    text = ""

    def read_until(condition):
        nonlocal text
        end = time.monotonic() + PATIENCE
        while not condition() and time.monotonic() < end:
            if select.select([terminal], [], [], 0.1)[0]:
                try:
                    text += os.read(terminal, 65536).decode("utf-8", "replace")
                except OSError:
                    return

    try:
        for command in setup["lines"] + ["echo rea''dy"]:
            os.write(terminal, command.encode() + b"\r")
        read_until(lambda: re.search(r"(^|[\r\n])[^'\r\n]*ready", text) is not None)
        text = ""
        os.write(terminal, line.encode() + b"\t")
        time.sleep(0.5)
        os.write(terminal, b"\t")
        read_until(lambda: all(word in text for word in wanted))
    finally:
        os.kill(pid, 9)
        os.waitpid(pid, 0)
        os.close(terminal)
    return text


def check_shells(folder, scratch):
    (scratch / "home").mkdir()
    (scratch / "work").mkdir()
    (scratch / "work" / "scan.nii.gz").touch()
    (scratch / "work" / "x[1].nrrd").touch()
    (scratch / "work" / "x1.nrrd").touch()
    share = {"bash": folder / "bash-completion" / "completions" / "tetwarp",
             "zsh": folder / "zsh" / "site-functions",
             "fish": folder / "fish" / "vendor_completions.d" / "tetwarp.fish"}
    shells = {
        "bash": (["bash", "--norc", "--noprofile", "-i"], ["bind 'set bell-style none'", f"source '{share['bash']}'"]),
        "zsh": (["zsh", "-f", "-i"], [f"fpath=('{share['zsh']}' $fpath)", "autoload -Uz compinit", "compinit -u -D",
                                      "unsetopt beep", "PS1='$ '"]),
        "fish": (["fish", "--no-config", "-i"], [f"source '{share['fish']}'"]),
    }
    lines = {
        "tetwarp ": ["deform", "simulate", "phantom", "bench"],
        "tetwarp deform --in": ["interpolation", "inverse"],
        "tetwarp deform x --interpolation ": ["nearest", "linear", "cubic", "vote"],
        "tetwarp invert --backend ": ["auto", "cuda", "cpu"],
        "tetwarp deform x -f ": ["wave", "bubble-paper", "scan.nii.gz"],
        "tetwarp info sc": ["scan.nii.gz"],
        "tetwarp info x": ["x1.nrrd", "[1"],  # shells write brackets in ways of their own
        "tetwarp info field --": ["json"],
    }
    for name, (shell, setup) in shells.items():
        if not shutil.which(name):
            print(f"{name}: left out, it is not installed")
            continue
        for line, wanted in lines.items():
            text = press_tab(shell, {"lines": setup, "home": str(scratch / "home"), "folder": str(scratch / "work")},
                             line, wanted)
            missing = [word for word in wanted if word not in text]
            expect(not missing, f"{name}: Tab behind {line!r} shows {missing}; it printed {text[-400:]!r}")


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    check_pages(program, folder)
    with tempfile.TemporaryDirectory() as scratch:
        check_shells(folder, pathlib.Path(scratch))
    return 1 if FAILURES else 0


if __name__ == "__main__":
    sys.exit(main())
