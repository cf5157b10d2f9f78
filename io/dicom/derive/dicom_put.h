// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: attributes that are written with DCMTK.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdatset.h>
#include <dcmtk/dcmdata/dcdeftag.h>

#include <cstdint>
#include <span>
#include <string>

#include "deform/volume.h"

namespace tetwarp {

/// DICOM decimal string (PS3.5 6.2, VR DS) of at most 16 characters: the shortest that is read back as `value`, or,
/// where 16 do not suffice, the nearest. @throws InputError for a value that is not finite
std::string decimal_string(double value);

/// Tag and keyword of an attribute: "(0008,0090) ReferringPhysicianName".
std::string tag_name(const DcmTagKey& tag);

/// Sets an attribute, replacing what it held. @throws Error naming the tag when DCMTK refuses
void put(DcmItem& item, const DcmTagKey& tag, const std::string& value);
void put(DcmItem& item, const DcmTagKey& tag, std::uint16_t value);
/// Sets an attribute of VR "US or SS". @throws Error naming the tag when DCMTK refuses
void put(DcmItem& item, const DcmTagKey& tag, std::int16_t value);
/// Sets decimal strings, unless those that are there already mean the same numbers within `tolerance`: then the text
/// stays, so that nothing drifts when a series is derived again and again.
void put_decimals(DcmItem& item, const DcmTagKey& tag, std::span<const double> values, double tolerance);

/// Adds those of the attributes that are missing, empty, as attributes of type 2 may be (PS3.5 7.4.3).
void put_missing(DcmItem& item, std::span<const DcmTagKey> tags);

/// Removes an attribute, if it is there.
void drop(DcmItem& item, const DcmTagKey& tag);

/// Appends an empty item to a sequence. The sequence is made if there is none, or if what is there could not be parsed.
DcmItem& append_item(DcmItem& item, const DcmTagKey& sequence);

/// Sets a sequence without items, replacing what is there.
void put_empty_sequence(DcmItem& item, const DcmTagKey& sequence);

/// Appends a code (PS3.3 8.8) of scheme DCM (PS3.16 annex D) to a code sequence.
void append_code(DcmItem& item, const DcmTagKey& sequence, const std::string& value, const std::string& meaning);

/// Puts Image Position (Patient) of slice k, Image Orientation (Patient) and Pixel Spacing; put_image_plane says when
/// decimal strings stay as they are.
void put_position(DcmItem& item, const Geometry& geometry, std::int64_t k);
void put_orientation(DcmItem& item, const Geometry& geometry);
void put_pixel_spacing(DcmItem& item, const Geometry& geometry);

/// Puts Image Plane (PS3.3 C.7.6.2): spacing, orientation, and the position of slice k. Decimal strings that are there
/// already and mean the same (1e-6 mm in position, 1e-7 in direction cosines and spacing) stay as they are, so that
/// nothing drifts when a series is derived again and again.
void put_image_plane(DcmItem& item, const Geometry& geometry, std::int64_t k);

/// The geometry of a volume that can be written as CT slices: all of its voxels in memory, int16, one component, and at
/// most 65535 rows and columns.
/// @throws InputError for any other volume
const Geometry& require_hu_volume(const ConstVolumeView& volume);

/// Voxels of slice k.
std::span<const std::int16_t> slice_of(const ConstVolumeView& volume, std::size_t k);

/// Puts Image Pixel (PS3.3 C.7.6.3) without Pixel Data: one sample for each pixel, all of whose bits are stored.
/// @param bits  of a sample
/// @throws InputError for more than 65535 rows or columns
void put_pixel_format(DcmItem& item, const Geometry& geometry, int bits, bool is_signed);

/// Puts Image Pixel (PS3.3 C.7.6.3) without Pixel Data, and the Modality LUT: signed 16-bit words whose unit is HU.
void put_hu_format(DcmItem& item, const Geometry& geometry);

/// Puts manufacturer, model and software versions of this program.
void put_tetwarp(DcmItem& item, const std::string& model);

/// At most `characters` characters of a text, from its beginning; what is not printable ASCII becomes '?'.
std::string ascii(const std::string& text, std::size_t characters);

}  // namespace tetwarp
