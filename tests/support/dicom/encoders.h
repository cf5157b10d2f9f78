// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <dcmtk/dcmdata/dcrleerg.h>
#include <dcmtk/dcmjpeg/djencode.h>
#include <dcmtk/dcmjpls/djencode.h>

/// Makes DCMTK's encoders known to it, in this process.
inline void register_encoders() {
  DcmRLEEncoderRegistration::registerCodecs();
  DJEncoderRegistration::registerCodecs();
  DJLSEncoderRegistration::registerCodecs(0, 0, 0, 0,
                                          // Takes the words as they are: with the other way DCMTK reads beyond the end
                                          // of images of odd size.
                                          OFFalse);
}
