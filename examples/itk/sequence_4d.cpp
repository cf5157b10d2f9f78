// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// One CT in motion: a filter, and a new field for each phase.
//
//   tetwarp-example-sequence-4d IMAGE SCENARIO.json OUTPUT_FOLDER
//
// A scenario (examples/scenarios, docs/guide/simulate.md) is played on the CT frame by frame, breathing in for example,
// and each frame becomes OUTPUT_FOLDER/phase_01.mha and so on. The pipeline is made once: image -> warp -> file. For
// each phase its itk::VertexField gets the next field, and Update does the rest: the filter sees that the field
// changed, and gives it to the resampler that it has. Nothing is composed or accumulated: every phase is sampled once,
// from the CT that was read. IMAGE is whatever ITK reads as a volume of HU; a DICOM series: see dicom_pipeline.cpp.
#include <itkImageFileReader.h>
#include <itkImageFileWriter.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <utility>

#include "deform/simulate/chainmail.h"
#include "deform/simulate/mass_spring.h"
#include "deform/simulate/scenario_run.h"
#include "io/scenario_file.h"
#include "itkbridge/itkVertexFieldResampleImageFilter.h"

namespace {

using ImageType = itk::Image<short, 3>;
using WarpType = itk::VertexFieldResampleImageFilter<ImageType>;

/// Measures the seconds since its last call.
class Watch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    return std::chrono::duration<double>(now - std::exchange(begun_, now)).count();
  }

 private:
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
};

/// The largest amount of memory that this process has had, MB.
double peak_megabytes() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

void run(const std::string& image, const std::string& scenario_file, const std::filesystem::path& folder) {
  using namespace tetwarp::simulate;
  const auto reader = itk::ImageFileReader<ImageType>::New();
  reader->SetFileName(image);
  reader->Update();
  const ImageType* const ct = reader->GetOutput();

  const Scenario scenario = tetwarp::read_scenario(scenario_file);
  const tetwarp::Geometry grid = tetwarp::geometry_of(*ct);
  const Patient patient = examine(tetwarp::view_of(*ct, grid), nullptr, scenario.cell_size, scenario.body_above_hu);
  const bool is_chainmail = scenario.method == Method::chainmail;
  ScenarioRun breathing(scenario, patient, [&](const Model& model) {
    return is_chainmail ? make_cpu_chainmail(model) : make_cpu_mass_spring(model);
  });

  const auto field = itk::VertexField::New();
  const auto warp = WarpType::New();
  warp->SetInput(reader->GetOutput());
  warp->SetVertexField(field);
  warp->SetDefaultPixelValue(-1024);
  const auto writer = itk::ImageFileWriter<ImageType>::New();
  writer->SetInput(warp->GetOutput());

  std::filesystem::create_directories(folder);
  std::printf("%-14s %10s %8s %8s %11s %9s %10s\n", "", "simulate s", "warp s", "write s", "covered", "uncovered",
              "peak MB");
  int buffers = 0;
  const short* buffer = nullptr;
  for (Watch watch; !breathing.is_done();) {
    const FrameResult frame = breathing.next();
    field->SetField(breathing.field());
    const double simulated = watch.lap();
    warp->Update();
    const double warped = watch.lap();
    const short* const written_to = warp->GetOutput()->GetBufferPointer();
    buffers += written_to != buffer;
    buffer = written_to;
    char name[32];
    std::snprintf(name, sizeof name, "phase_%02d.mha", frame.number);
    writer->SetFileName((folder / name).string());
    writer->Update();
    const double written = watch.lap();
    const tetwarp::Report& report = warp->GetReport();
    std::printf("%-14s %10.3f %8.3f %8.3f %11llu %9llu %10.0f\n", name, simulated, warped, written,
                static_cast<unsigned long long>(report.covered), static_cast<unsigned long long>(report.uncovered),
                peak_megabytes());
  }
  std::printf("output buffers that were allocated: %d\n", buffers);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: tetwarp-example-sequence-4d IMAGE SCENARIO.json OUTPUT_FOLDER\n";
    return 2;
  }
  std::string error;
  try {
    run(argv[1], argv[2], argv[3]);
    return 0;
  } catch (const itk::ExceptionObject& thrown) {
    error = thrown.GetDescription();
  } catch (const std::exception& thrown) {
    error = thrown.what();
  }
  std::replace(error.begin(), error.end(), '\n', ' ');
  std::cerr << "tetwarp-example-sequence-4d: error: " << error << '\n';
  return 1;
}
