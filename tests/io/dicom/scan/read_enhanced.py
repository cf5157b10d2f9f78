# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Writes what pydicom and numpy make of an Enhanced CT file: an independent reader.

    read_enhanced.py FILE OUT

OUT: HU, rounded half to even, int16, little endian, slices sorted along row x column. Prints the LPS affine of continuous
index, 12 numbers, row by row. Exit status 0: done, 77: the reader is missing.
"""

import sys

try:
    import numpy as np
    import pydicom
except ImportError as error:
    print(error)
    sys.exit(77)


def group(data, number, name):
    """A functional group of a frame: its own, else the shared one (PS3.3 C.7.6.16)."""
    own = data.PerFrameFunctionalGroupsSequence[number]
    return getattr(own if name in own else data.SharedFunctionalGroupsSequence[0], name)[0]


data = pydicom.dcmread(sys.argv[1])
frames = range(int(data.NumberOfFrames))
positions = [np.array(group(data, n, "PlanePositionSequence").ImagePositionPatient, float) for n in frames]
cosines = np.array(group(data, 0, "PlaneOrientationSequence").ImageOrientationPatient, float)
row, column = cosines[:3], cosines[3:]
normal = np.cross(row, column)
order = sorted(frames, key=lambda n: float(normal @ positions[n]))
rows_apart, columns_apart = (float(v) for v in group(data, 0, "PixelMeasuresSequence").PixelSpacing)
step = (positions[order[-1]] - positions[order[0]]) / max(len(order) - 1, 1)
affine = np.column_stack([row * columns_apart, column * rows_apart, step, positions[order[0]]])
print(*[repr(float(v)) for v in affine.ravel()])

pixels = data.pixel_array
with open(sys.argv[2], "wb") as out:
    for n in order:
        values = group(data, n, "PixelValueTransformationSequence")
        hu = pixels[n].astype(float) * float(values.RescaleSlope) + float(values.RescaleIntercept)
        out.write(np.rint(hu).astype("<i2").tobytes())
