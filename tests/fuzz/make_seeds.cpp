// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Writes small whole files of every form that a fuzz target reads: seeds FOLDER makes FOLDER/TARGET/FILE. Made in code,
// with ITK, DCMTK and what the tests make their files with.
#include <itk_H5Cpp.h>

#include <algorithm>
#include <iostream>

#include "io/field_file.h"
#include "io/image_file.h"
#include "tests/fuzz/input_file.h"
#include "tests/itkbridge/itk_transforms.h"
#include "tests/support/dicom/coded_slices.h"
#include "tests/support/dicom/enhanced_maker.h"
#include "tests/support/dicom/seg_maker.h"
#include "tests/support/dicom/structure_maker.h"
#include "tests/support/gmsh_file.h"
#include "tests/support/image_samples.h"
#include "tests/support/point_files.h"
#include "tests/support/write_file.h"

namespace {

using namespace tetwarp;
namespace fs = std::filesystem;

fs::path folder_of(const fs::path& root, const std::string& target) {
  fs::create_directories(root / target);
  return root / target;
}

Geometry small_grid() {
  Geometry grid = oblique_grid();
  grid.size = {3, 2, 2};
  return grid;
}

void make_texts(const fs::path& root) {
  int n = 0;
  for (const char* text :
       {"identity", "wave:amplitude=8,wavelength=64,phase=0.5,axis=y,along=x", "wave:amplitude=2vox,wavelength=9vox",
        "twist:angle=30,axis=x", "bubble:radius=6,strength=0.3,center=1/2/3", "bubble-paper:shift=-1vox",
        "translate:by=1/-2.5/3vox", "field.npy:order=zyx,units=mm,components=zyx", "C:field.mha", "a:b=c,b=d"})
    write_file(folder_of(root, "text") / std::to_string(n++), text);
}

/// An array of 2 x 1 x 2 vectors.
std::string npy(int version, const std::string& type, bool fortran) {
  const std::string shape = "(2, 1, 2, 3)", order = fortran ? "True" : "False";
  const std::string text = "{'descr': '" + type + "', 'fortran_order': " + order + ", 'shape': " + shape + ", }\n";
  std::string bytes = "\x93NUMPY";
  bytes += static_cast<char>(version);
  bytes += '\0';
  if (version == 1) {
    append_value(bytes, static_cast<std::uint16_t>(text.size()));
  } else {
    append_value(bytes, static_cast<std::uint32_t>(text.size()));
  }
  return bytes + text + std::string(type.ends_with('8') ? 96 : 48, '\x3f');
}

void make_arrays(const fs::path& root) {
  for (const int version : {1, 2, 3}) {
    for (const std::string type : {"<f4", ">f8"}) {
      const std::string name = "v" + std::to_string(version) + type.substr(1) + ".npy";
      write_file(folder_of(root, "npy") / name, npy(version, type, version == 2));
    }
  }
}

/// Volumes and fields of one suffix.
void make_images(const fs::path& folder, const std::string& suffix) {
  for (const VoxelType type : {VoxelType::u8, VoxelType::i16, VoxelType::f32, VoxelType::f64}) {
    const AnyVolume volume = numbered(small_grid(), type);
    const ConstVolumeView view{&volume.geometry(), whole(volume.geometry()), type, 1, volume.data()};
    write_image(folder / (to_string(type) + suffix), view);
    if (!suffix.starts_with(".nii"))
      write_image(folder / ("packed-" + to_string(type) + suffix), view, {.compression = 9});
  }
  const std::vector<glm::vec3> displacement(static_cast<std::size_t>(voxel_count(small_grid())), glm::vec3(3, 5, 7));
  write_field_file(folder / ("forward" + suffix), VertexField{small_grid(), displacement});
  write_field_file(folder / ("pull" + suffix), PullField{small_grid(), displacement});
}

/// Writes the same vectors under the headers of several tools.
void make_nifti_kinds(const fs::path& folder) {
  const std::string ours = read_bytes(folder / "forward.nii");
  constexpr std::size_t kIntentP1 = 56, kIntentCode = 68, kSlope = 112, kDescrip = 148, kIntentName = 328;
  std::string vectors = ours, displacements = ours, positions = ours, scaled = read_bytes(folder / "int16.nii");
  put(vectors, kDescrip, '\0');
  write_file(folder / "vectors.nii", vectors);
  put(displacements, kIntentCode, std::int16_t{1006});
  write_file(folder / "displacements.nii", displacements);
  positions.replace(kIntentName, 11, std::string("NREG_TRANS") + '\0');
  write_file(folder / "niftyreg-positions.nii", positions);
  put(positions, kIntentP1, 1.0f);
  write_file(folder / "niftyreg-displacements.nii", positions);
  put(scaled, kSlope, 0.5f);
  put(scaled, kSlope + 4, -1024.0f);
  write_file(folder / "scaled.nii", scaled);
}

void make_all_images(const fs::path& root) {
  for (const std::string suffix : {".mha", ".nrrd", ".nii"}) make_images(folder_of(root, suffix.substr(1)), suffix);
  make_images(folder_of(root, "nii-gz"), ".nii.gz");
  make_nifti_kinds(root / "nii");
  const std::string bytes = read_bytes(root / "nii" / "displacements.nii");
  write_gzipped(root / "nii-gz" / "one-member.nii.gz", bytes);
}

Geometry spline_lattice() {
  Geometry grid = oblique_grid();
  grid.size = {4, 4, 4};
  return grid;
}

void make_itk_transforms(const fs::path& root) {
  const ItkTransform shift("TranslationTransform_double_3_3", {}, {3, 5, 7});
  const ItkTransform euler("Euler3DTransform_double_3_3", {10, -20, 30, 1}, {0.1, 0.2, 0.3, 3, 5, 7});
  const ItkTransform spline("BSplineTransform_double_3_3", grid_numbers(spline_lattice()),
                            std::vector<double>(192, 0.5));
  const ItkTransform field("DisplacementFieldTransform_double_3_3", grid_numbers(small_grid()),
                           std::vector<double>(36, 1.5));
  for (const auto& [target, suffix] : {std::pair{"transform-text", ".txt"}, {"transform-h5", ".h5"}}) {
    const fs::path folder = folder_of(root, target);
    shift.write(folder / (std::string("shift") + suffix));
    euler.write(folder / (std::string("euler") + suffix));
    spline.write(folder / (std::string("spline") + suffix));
    field.write(folder / (std::string("field") + suffix));
    ItkTransform(std::vector<ItkTransform>{shift, spline}).write(folder / (std::string("both") + suffix));
  }
}

/// ITK's layout in 2 kB; its own writer leaves much room in 8 kB.
class SmallHdf5 {
 public:
  SmallHdf5(const fs::path& path, std::size_t type_length)
      : file_(path.string(), H5F_ACC_TRUNC, packed_file(), packed_access()) {
    constexpr std::size_t kHeap = 96;  // bytes of names
    file_.createGroup("/TransformGroup", kHeap).createGroup("0", kHeap);
    std::string type = "TranslationTransform_double_3_3";
    const hsize_t one = 1;
    const H5::StrType text(H5::PredType::C_S1, type_length);
    const H5::DataSet set = file_.createDataSet(kGroup + "/TransformType", text, H5::DataSpace(1, &one));
    if (type_length > type.size()) return;  // allocated late: not at all
    set.write(type, text);
  }

  /// @param chunk  values in one, deflated; 0: they lie side by side
  void add(const std::string& name, hsize_t count, hsize_t chunk, bool with_values) {
    H5::DSetCreatPropList layout;
    if (chunk > 0) layout.setChunk(1, &chunk);
    if (chunk > 0) layout.setDeflate(9);
    const H5::DataSet set =
        file_.createDataSet(kGroup + "/" + name, H5::PredType::NATIVE_DOUBLE, H5::DataSpace(1, &count), layout);
    const std::vector<double> values(with_values ? count : 0, 1.5);
    if (with_values) set.write(values.data(), H5::PredType::NATIVE_DOUBLE);
  }

 private:
  inline static const std::string kGroup = "/TransformGroup/0";

  static H5::FileCreatPropList packed_file() {
    H5::FileCreatPropList list;
    list.setSymk(1, 2);
    list.setIstorek(1);
    return list;
  }
  static H5::FileAccPropList packed_access() {
    H5::FileAccPropList list;
    H5Pset_meta_block_size(list.getId(), 0);
    H5Pset_small_data_block_size(list.getId(), 0);
    return list;
  }

  H5::H5File file_;
};

/// Whole ones, and headers that promise more than any file holds.
void make_hdf5(const fs::path& folder) {
  constexpr std::size_t kType = 31;
  constexpr hsize_t kHuge = hsize_t{1} << 40;
  const auto make = [&](const std::string& name, std::size_t type_length, hsize_t count, hsize_t chunk,
                        bool with_values) {
    SmallHdf5 file(folder / (name + ".h5"), type_length);
    file.add("TransformFixedParameters", 3, 0, true);
    file.add("TransformParameters", count, chunk, with_values);
  };
  make("small", kType, 3, 0, true);
  make("small-deflated", kType, 3, 3, true);
  make("refused-length-of-type", 0x7fffffff, 3, 0, true);
  make("refused-count", kType, kHuge, 0, false);
  make("refused-count-in-chunks", kType, kHuge, 16, false);
  std::string bytes = read_bytes(folder / "small-deflated.h5");
  const std::string three_doubles("\3\0\0\0\10\0\0\0", 8);  // in the layout of the chunks
  put(bytes, bytes.find(three_doubles), std::uint32_t{1} << 28);
  write_file(folder / "refused-size-of-chunk.h5", bytes);
}

void make_other_transforms(const fs::path& folder) {
  const std::string end =
      "(InitialTransformParametersFileName \"NoInitialTransform\")\n(HowToCombineTransforms \"Compose\")\n"
      "(FixedImageDimension 3)\n(MovingImageDimension 3)\n(Size 20 18 12)\n(Index 0 0 0)\n(Spacing 3 3 4)\n"
      "(Origin -30 -27 -22)\n(Direction 1 0 0 0 1 0 0 0 1)\n(UseDirectionCosines \"true\")\n";
  write_file(folder / "elastix-euler.txt",
             "(Transform \"EulerTransform\")\n(NumberOfParameters 6)\n(TransformParameters 0.1 "
             "0.2 0.3 3 5 7)\n(CenterOfRotationPoint 10 -20 30)\n(ComputeZYX \"true\")\n" +
                 end);
  std::string zeros;
  for (int n = 0; n < 192; ++n) zeros += " 0";
  write_file(folder / "elastix-spline.txt",
             "(Transform \"BSplineTransform\")\n(NumberOfParameters 192)\n(TransformParameters" + zeros +
                 ")\n(GridSize 4 4 4)\n(GridIndex 1 2 -1)\n(GridSpacing 15 14 13)\n(GridOrigin -60 -50 -26)\n"
                 "(GridDirection 0.96 0.28 0 -0.28 0.96 0 0 0 1)\n(BSplineTransformSplineOrder 3)\n"
                 "(UseCyclicTransform \"false\")\n" +
                 end);
  std::string lines;
  for (int n = 0; n < 192; ++n) lines += "1\n";
  write_file(folder / "plastimatch.txt",
             "MGH_GPUIT_BSP <experimental>\nimg_origin = -20 10 5\nimg_spacing = 2 1.5 2.5\nimg_dim = 40 30 20\n"
             "roi_offset = 2 1 0\nroi_dim = 10 10 8\nvox_per_rgn = 10 10 8\ndirection_cosines = 0 -1 0 1 0 0 0 0 1\n" +
                 lines);
}

void make_points(const fs::path& root) {
  write_file(folder_of(root, "points-csv") / "a.csv", sample_csv());
  write_file(folder_of(root, "points-csv") / "quoted.csv", "\"x\",\"y\",z,status\r\n1,\"2\",3,\"a, \"\"b\"\"\"\r\n");
  for (const PointForm& form : point_forms()) {
    const std::string suffix = form.name.substr(form.name.find('.') + 1);
    write_file(folder_of(root, "points-" + suffix) / ("lps-" + form.name), form.lps);
    write_file(folder_of(root, "points-" + suffix) / ("ras-" + form.name), form.ras);
  }
}

/// Whole ones, and counts that no file holds.
void make_meshes(const fs::path& folder) {
  for (const GmshStyle& style : gmsh_styles()) {
    std::string name = style.name() + ".msh";
    std::erase(name, ',');
    std::ranges::replace(name, ' ', '-');
    write_file(folder / name, GmshSample{}.write(style));
  }
  for (const std::string version : {"2.2", "4.1"}) {
    for (const std::string part : {"$Nodes", "$Elements"}) {
      std::string bytes = GmshSample{}.write({version});
      const std::size_t begin = bytes.find(part + "\n") + part.size() + 1, end = bytes.find('\n', begin);
      const std::string counts = version == "2.2" ? "4000000000000000000" : "2 4000000000000000000 1 4000000000";
      bytes.replace(begin, end - begin, counts);
      write_file(folder / ("refused-count-of-" + part.substr(1) + "-" + version + ".msh"), bytes);
    }
  }
}

void make_dose(const fs::path& folder) {
  MadeSlice dose;
  dose.rows = 2;
  dose.columns = 4;
  dose.words = std::vector<std::uint16_t>(24, 1000);
  dose.is_signed = false;
  dose.sop_class = UID_RTDoseStorage;
  dose.modality = "RTDOSE";
  dose.edit = [](DcmDataset& data) {
    data.putAndInsertString(DCM_DoseUnits, "GY");
    data.putAndInsertString(DCM_NumberOfFrames, "3");
    data.putAndInsertString(DCM_GridFrameOffsetVector, "0\\2.5\\5");
    data.putAndInsertString(DCM_DoseGridScaling, "0.0005");
  };
  write_slice(folder / "dose.dcm", dose);
}

void make_segmentations(const fs::path& folder) {
  const auto value = [](int n, int i, int j, int k) { return (i + j + k + n) % 3 / 2; };
  for (const bool fractional : {false, true}) {
    MadeSeg seg{.fractional = fractional, .value = value};
    seg.write(folder / (fractional ? "seg-fractional.dcm" : "seg-binary.dcm"));
  }
  register_encoders();
  MadeSeg{.label_bits = 16, .value = value}.write(folder / "seg-labels.dcm");
  MadeSeg{.label_bits = 8, .value = value, .encoding = EXS_RLELossless}.write(folder / "seg-labels-rle.dcm");
}

void make_structure_set(const fs::path& folder) {
  MadeStructures made;
  made.rois = {{{"CLOSED_PLANAR", {{0, 0, 0}, {9, 0, 0}, {9, 9, 0}}}, {"POINT", {{1, 2, 3}}}},
               {{"OPEN_NONPLANAR", {{0, 0, 0}, {8, 6, 7}}}}};
  write_structures(folder / "structures.dcm", made);
}

/// One slice in every transfer syntax.
void make_slices(const fs::path& folder) {
  for (const E_TransferSyntax encoding :
       {EXS_LittleEndianExplicit, EXS_LittleEndianImplicit, EXS_BigEndianExplicit, EXS_DeflatedLittleEndianExplicit}) {
    MadeSlice slice;
    slice.encoding = encoding;
    write_slice(folder / ("encoding-" + std::to_string(encoding) + ".dcm"), slice);
  }
  for (const Coding& coding : codings()) {
    const std::string frame = coding.frame(folder);
    write_encapsulated(folder / (coding.name + ".dcm"), coding.slice(), coding.uid,
                       {frame.substr(0, 40), frame.substr(40)}, {0});
  }
  MadeSlice bytes;
  bytes.bits_allocated = bytes.bits_stored = 8;
  bytes.high_bit = 7;
  bytes.is_signed = false;
  bytes.slope = "2.5";
  bytes.edit = [](DcmDataset& data) { data.putAndInsertUint16(DCM_PixelPaddingValue, 3); };
  write_slice(folder / "bytes.dcm", bytes);
}

/// Slices in one input.
std::string joined(const fs::path& scratch, const std::vector<MadeSlice>& slices) {
  std::string bytes;
  for (const MadeSlice& slice : slices) {
    write_slice(scratch / "slice", slice);
    bytes += std::string(bytes.empty() ? "" : kNextFile) + read_bytes(scratch / "slice");
  }
  fs::remove(scratch / "slice");
  return bytes;
}

/// A DICOMDIR that names "IM2" and so on.
std::string directory_of(const fs::path& scratch, std::size_t count) {
  MadeSlice directory;
  directory.sop_class = UID_MediaStorageDirectoryStorage;
  directory.edit = [&](DcmDataset& data) {
    data.clear();
    data.putAndInsertString(DCM_SOPClassUID, UID_MediaStorageDirectoryStorage);
    data.putAndInsertString(DCM_SOPInstanceUID, "1.2.3.99");
    for (std::size_t n = 2; n < 2 + count; ++n) {
      DcmItem* record = nullptr;
      data.findOrCreateSequenceItem(DCM_DirectoryRecordSequence, record, -2);
      record->putAndInsertString(DCM_DirectoryRecordType, "IMAGE");
      record->putAndInsertString(DCM_ReferencedFileID, ("IM" + std::to_string(n)).c_str());
    }
  };
  return joined(scratch, {directory});
}

/// Series of several files, each an input: a stack, one that leans, an uneven one, phases, copies, a DICOMDIR.
void make_folders(const fs::path& folder) {
  std::vector<MadeSlice> stack;
  for (int k = 0; k < 6; ++k) {
    MadeSlice& slice = stack.emplace_back();
    slice.position = position_text(-10, -20, 30 + 2.5 * k);
    slice.instance_number = k + 1;
    slice.sop_instance = std::string("1.2.3.").append(std::to_string(k + 1));
    slice.words = {static_cast<std::uint16_t>(k)};
  }
  std::vector<MadeSlice> leaning = stack, uneven(stack.begin(), stack.begin() + 3), phases = stack, copies = uneven;
  for (int k = 0; k < 6; ++k) leaning[k].position = position_text(-10, -20 + k, 30 + 2.5 * k);
  uneven[2].position = stack[4].position;
  for (int k = 0; k < 6; ++k) {
    phases[k].position = stack[k % 3].position;
    phases[k].edit = [phase = 50 * (k / 3)](DcmDataset& data) {
      data.putAndInsertString(DCM_SpecificCharacterSet, "ISO_IR 100");
      data.putAndInsertString(DCM_SeriesDescription, ("Gated, " + std::to_string(phase) + ".0%").c_str());
    };
  }
  copies[1] = copies[2] = copies[0];
  copies[1].encoding = EXS_RLELossless;
  write_file(folder / "stack", joined(folder, stack));
  write_file(folder / "leaning", joined(folder, leaning));
  write_file(folder / "uneven", joined(folder, uneven));
  write_file(folder / "phases", joined(folder, phases));
  write_file(folder / "copies", joined(folder, copies));
  write_file(folder / "directory", directory_of(folder, stack.size()) + std::string(kNextFile) + joined(folder, stack));
}

/// Frames behind the header that dicom_decode_target.cpp reads.
void make_frames(const fs::path& folder) {
  // In the order of numbers there; its three syntaxes of high throughput are one here.
  const std::vector<std::string> order = {"Rle",         "Jpeg1",    "Jpeg2And4",     "Jpeg6And8",
                                          "Jpeg10And12", "Jpeg14",   "Jpeg14Sv1",     "JpegLs",
                                          "JpegLsLossy", "Jpeg2000", "Jpeg2000Lossy", "HighThroughput"};
  for (const Coding& coding : codings()) {
    const auto number = std::ranges::find(order, coding.name) - order.begin();
    if (number == std::ssize(order)) continue;
    const MadeSlice slice = coding.slice();
    std::string bytes;
    for (const long value : {long{number}, long{slice.bits_allocated}, long{slice.bits_stored}, 0L})
      bytes += static_cast<char>(value);
    append_value(bytes, static_cast<std::uint16_t>(slice.rows));
    append_value(bytes, static_cast<std::uint16_t>(slice.columns));
    write_file(folder / coding.name, bytes + coding.frame(folder));
  }
}

/// Four frames in two transfer syntaxes.
void make_enhanced(const fs::path& folder) {
  for (const E_TransferSyntax encoding : {EXS_LittleEndianExplicit, EXS_RLELossless})
    MadeEnhanced().write(folder / ("enhanced-" + std::to_string(encoding) + ".dcm"), classic_stack(4), encoding);
}

void make_dicom(const fs::path& root) {
  register_encoders();
  make_slices(folder_of(root, "dicom"));
  make_dose(root / "dicom");
  make_segmentations(root / "dicom");
  make_structure_set(root / "dicom");
  make_enhanced(root / "dicom");
  make_slices(folder_of(root, "dicom-scan"));
  make_enhanced(root / "dicom-scan");
  make_folders(root / "dicom-scan");
  make_frames(folder_of(root, "dicom-decode"));
  DJLSEncoderRegistration::cleanup();
  DJEncoderRegistration::cleanup();
  DcmRLEEncoderRegistration::cleanup();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: tetwarp-fuzz-seeds FOLDER\n";
    return 2;
  }
  const fs::path root = argv[1];
  make_texts(root);
  make_arrays(root);
  make_all_images(root);
  make_itk_transforms(root);
  make_hdf5(root / "transform-h5");
  make_other_transforms(root / "transform-text");
  make_points(root);
  make_meshes(folder_of(root, "mesh-msh"));
  make_dicom(root);
  return 0;
}
