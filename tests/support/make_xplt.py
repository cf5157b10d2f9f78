#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Writes a plot file of FEBio by its published layout (FEBioPlotFile.h): make_xplt.py VERSION FILE.

VERSION 2 is that of FEBio 2: the mesh lies in the root, nodes have no numbers, names have 64 bytes. VERSION 53 is that of
FEBio 4: the mesh lies behind the root, nodes have numbers (10, 20, ...), names have their length before them. A
hexahedron and a wedge on it, a triangle, and two states, the second with the displacement (z, 0, x).
"""

import struct
import sys

POINTS = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2), (0, 0, 4), (2, 0, 4)]
DOMAINS = [(0, [(0, 1, 2, 3, 4, 5, 6, 7)]), (1, [(4, 7, 8, 5, 6, 9)]), (4, [(0, 1, 2)])]


def chunk(kind, content):
    return struct.pack("<II", kind, len(content)) + content


def number(kind, value):
    return chunk(kind, struct.pack("<I", value))


def text(kind, name, version):
    data = name.encode()
    return chunk(kind, data.ljust(64, b"\0") if version == 2 else struct.pack("<I", len(data)) + data.ljust(12, b"\0"))


def item(kind, name, version):
    return chunk(0x01020001, number(0x01020002, kind) + number(0x01020003, 0) + text(0x01020004, name, version))


def mesh(version):
    if version == 2:
        nodes = chunk(0x01041001, b"".join(struct.pack("<3f", *point) for point in POINTS))
    else:
        nodes = chunk(0x01041100, number(0x01041101, len(POINTS)) + number(0x01041102, 3))
        nodes += chunk(0x01041200, b"".join(struct.pack("<i3f", 10 * n + 10, *p) for n, p in enumerate(POINTS)))
    domains = b""
    for kind, elements in DOMAINS:
        header = number(0x01042102, kind) + number(0x01042103, 1) + number(0x01032104, len(elements))
        listed = b"".join(
            chunk(0x01042201, struct.pack(f"<{len(nodes_of) + 1}i", kind + n + 1, *nodes_of))
            for n, nodes_of in enumerate(elements)
        )
        domains += chunk(0x01042100, chunk(0x01042101, header) + chunk(0x01042200, listed))
    return chunk(0x01040000, chunk(0x01041000, nodes) + chunk(0x01042000, domains))


def state(time, factor):
    pressures = b"".join(struct.pack("<f", time) for _ in POINTS)
    vectors = b"".join(struct.pack("<3f", factor * z, 0, factor * x) for x, _, z in POINTS)
    variables = b""
    for index, values in ((1, pressures), (2, vectors)):
        variables += chunk(0x02020001, number(0x02020002, index) + chunk(0x02020003, chunk(0, values)))
    header = chunk(0x02010002, struct.pack("<f", time))
    return chunk(0x02000000, chunk(0x02010000, header) + chunk(0x02020000, chunk(0x02020300, variables)))


def main():
    version, path = int(sys.argv[1]), sys.argv[2]
    nodal = item(0, "pressure", version) + item(1, "displacement", version)
    root = chunk(0x01010000, number(0x01010001, version) + number(0x01010004, 0))
    root += chunk(0x01020000, chunk(0x01023000, nodal))
    whole = chunk(0x01000000, root + mesh(2)) if version == 2 else chunk(0x01000000, root) + mesh(version)
    with open(path, "wb") as file:
        file.write(struct.pack("<I", 0x00464542) + whole + state(0, 0) + state(1, 0.25))


if __name__ == "__main__":
    main()
