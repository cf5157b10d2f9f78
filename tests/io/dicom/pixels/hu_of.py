# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Writes what pydicom and numpy make of the pixels of DICOM files, doubles, rows top to bottom.

    hu_of.py FILE OUT [FILE OUT ...]

The stored value is the Bits Stored below High Bit, with the sign of Pixel Representation (PS3.5 8.1.1): pydicom itself
takes whole words. Compressed pixels are decoded by GDCM, RLE by pydicom. Exit status 0: done, 77: a reader is missing.
"""

import sys

try:
    import numpy as np
    import pydicom
    from pydicom.pixel_data_handlers import gdcm_handler
except ImportError as error:
    print(error)
    sys.exit(77)


def words_of(data):
    if not data.file_meta.TransferSyntaxUID.is_compressed or data.file_meta.TransferSyntaxUID.is_deflated:
        word = {8: "u1", 16: "<u2"}[data.BitsAllocated]
        return np.frombuffer(data.PixelData, word)[: data.Rows * data.Columns].astype(np.int64)
    if not gdcm_handler.is_available():
        print("GDCM is missing")
        sys.exit(77)
    return data.pixel_array.ravel().astype(np.int64)


def hu_of(data):
    stored = (words_of(data) >> (data.HighBit + 1 - data.BitsStored)) & ((1 << data.BitsStored) - 1)
    if data.PixelRepresentation == 1:
        stored[stored >= 1 << (data.BitsStored - 1)] -= 1 << data.BitsStored
    return stored * float(data.RescaleSlope) + float(data.RescaleIntercept)


for file, out in zip(sys.argv[1::2], sys.argv[2::2]):
    hu_of(pydicom.dcmread(file)).tofile(out)
