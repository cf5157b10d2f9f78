# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""The program `tetwarp`, as the package installs it."""

import sys

from . import _core


def main() -> int:
    """Runs the command line of this process. Returns its exit status."""
    return _core.run_program(["tetwarp", *sys.argv[1:]])


if __name__ == "__main__":
    raise SystemExit(main())
