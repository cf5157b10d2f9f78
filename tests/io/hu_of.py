"""Writes what pydicom and numpy make of the pixels of a DICOM file, doubles, rows top to bottom.

    hu_of.py FILE OUT

The stored value is the Bits Stored below High Bit, with the sign of Pixel Representation (PS3.5 8.1.1): pydicom itself
takes whole words. Exit status 0: done, 77: the reader is missing.
"""

import sys

try:
    import numpy as np
    import pydicom
except ImportError as error:
    print(error)
    sys.exit(77)

data = pydicom.dcmread(sys.argv[1])
word = {8: "u1", 16: "<u2"}[data.BitsAllocated]
stored = np.frombuffer(data.PixelData, word)[: data.Rows * data.Columns].astype(np.int64)
stored = (stored >> (data.HighBit + 1 - data.BitsStored)) & ((1 << data.BitsStored) - 1)
if data.PixelRepresentation == 1:
    stored[stored >= 1 << (data.BitsStored - 1)] -= 1 << data.BitsStored
(stored * float(data.RescaleSlope) + float(data.RescaleIntercept)).tofile(sys.argv[2])
