#include "apps/option_groups.h"

#include <map>

namespace tetwarp::apps {

const char* const kInputHelp = "Folder of DICOM files, one DICOM file, or .nii .nii.gz .nrrd .mha";
const char* const kFieldHelp =
    "Forward field: a file (.mha .nrrd .nii .nii.gz, .npy:order=zyx|xyz,units=mm|voxel, or .vts .vti .vtr .vtk "
    "[:displacement=NAME,frame=lps|ras,units=mm|m]), a transform of ITK, "
    "elastix, plastimatch (.h5 .tfm .txt) or NiftyReg (its B-spline; each vertex x goes to T(x)), a mesh (.msh .vtu "
    ".vtk, "
    "the first of several), or identity, "
    "wave:amplitude=,wavelength=[,phase=,axis=,along=], "
    "twist:angle=[,axis=], bubble:radius=,strength=[,center=X/Y/Z], bubble-paper:shift=[,center=], "
    "elastic:amplitude=,spacing=,seed=, translate:by=X/Y/Z; "
    "mm, "
    "or voxels with the suffix vox; degrees. Several compose, the first is applied first";

void add_common(CLI::App& command, CommonOptions& common, bool writes) {
  command.add_option("--threads", common.threads, "Threads; 0 is all")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command.add_flag("--quiet", common.quiet, "Say nothing unless something is wrong");
  command.add_flag("--verbose", common.verbose, "Say how long each stage takes");
  if (writes) command.add_flag("--overwrite", common.overwrite, "Replace an output that exists");
}

void add_series(CLI::App& command, InputOptions& input) {
  command.add_option("--series", input.series, "Series Instance UID, or the number that `tetwarp info` prints")
      ->type_name("UID");
  command.add_flag("--single", input.single, "Read the one DICOM file alone, not its series");
  command
      .add_option_function<std::string>(
          "--uneven", [&input](const std::string& wanted) { input.uneven = wanted == "exact"; },
          "Slices at uneven distances: refuse them, or take each exactly where it is")
      ->check(CLI::IsMember({"refuse", "exact"}))
      ->default_str("refuse");
}

void add_nifti_frame(CLI::App& command, CommonOptions& common, InputOptions& input) {
  command
      .add_option_function<std::string>(
          "--nifti-frame",
          [&common, &input](const std::string& name) {
            common.nifti_frame = input.nifti_frame = name == "qform" ? NiftiFrame::qform : NiftiFrame::sform;
          },
          "What places a NIfTI file that has both: its sform, as nibabel and FSL have it, or its qform, which ITK "
          "takes "
          "unless the sform's code is 1. For every file that is read")
      ->check(CLI::IsMember({"sform", "qform"}))
      ->type_name("sform|qform")
      ->default_str("sform");
}

void add_backend(CLI::App& command, std::string& backend, int& device, const char* help) {
  command.add_option("--backend", backend, help)->check(CLI::IsMember({"auto", "cuda", "cpu"}))->capture_default_str();
  command.add_option("--device", device, "CUDA device, as `tetwarp --version` numbers them")
      ->check(CLI::NonNegativeNumber)
      ->type_name("N")
      ->capture_default_str();
}

void add_outside(CLI::App& command, Outside& outside) {
  const std::map<std::string, Outside> outsides = {
      {"refuse", Outside::refuse}, {"rest", Outside::rest}, {"background", Outside::background}};
  command
      .add_option("--outside", outside, "A field that does not cover the volume: refuse (default), rest or background")
      ->transform(CLI::Transformer(outsides).description(""))
      ->type_name("NAME");
}

}  // namespace tetwarp::apps
