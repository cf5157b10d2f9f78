#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What examples/quickstart.sh wants installed, and what it says to those who cannot install it.

    check_quickstart.py SOURCE_FOLDER

Exit status 0: all holds, 1: something does not.
"""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile


def main():
    source = pathlib.Path(sys.argv[1])
    script = source / "examples" / "quickstart.sh"
    packages = subprocess.run([script, "--packages"], stdout=subprocess.PIPE, text=True, check=True).stdout.split()
    guide = (source / "docs" / "guide" / "install.md").read_text(encoding="utf-8")
    wrong = [f"docs/guide/install.md does not name {package}" for package in packages
             if package != "ca-certificates" and package not in guide]
    if len(packages) < 20:
        wrong.append(f"--packages names {packages}")

    # A system without any of them, whose user has neither root nor sudo.
    with tempfile.TemporaryDirectory() as scratch:
        for tool in ("bash", "dirname", "grep"):
            (pathlib.Path(scratch) / tool).symlink_to(shutil.which(tool))
        for name, body in (("id", "echo 1000"), ("dpkg-query", "exit 1")):
            program = pathlib.Path(scratch) / name
            program.write_text(f"#!{shutil.which('bash')}\n{body}\n", encoding="utf-8")
            program.chmod(0o755)
        done = subprocess.run([shutil.which("bash"), script], env={**os.environ, "PATH": scratch}, cwd=scratch, capture_output=True,
                              text=True)
        left = sorted(path.name for path in pathlib.Path(scratch).iterdir())
    if done.returncode != 1 or "apt-get install " + " ".join(packages) not in done.stderr:
        wrong.append(f"without root: exit status {done.returncode}, {done.stderr!r}")
    if left != ["bash", "dirname", "dpkg-query", "grep", "id"]:
        wrong.append(f"without root: it left {left}")
    for line in wrong:
        print("FAILED:", line)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
