// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// A CT from DICOM to NIfTI in one ITK pipeline: read, deform by a simulation, filter, write.
//
//   tetwarp-example-dicom-pipeline DICOM_FOLDER SCENARIO.json OUTPUT.nii.gz
//
// The series is read twice, by ITK's reader (GDCM) and by Tetwarp's (DCMTK), and both must give the same voxels at the
// same places; otherwise the program says what differs, and ends with status 1. The volume that Tetwarp read becomes an
// itk::Image without a copy. A scenario (examples/scenarios, docs/guide/simulate.md) then says what is held and moved;
// where the simulation takes the vertices of its lattice is an itk::VertexField, the second input of
// itk::VertexFieldResampleImageFilter. Whatever filter of ITK comes next is connected as always: here a median.
#include <itkGDCMImageIO.h>
#include <itkGDCMSeriesFileNames.h>
#include <itkImageFileWriter.h>
#include <itkImageSeriesReader.h>
#include <itkMedianImageFilter.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <glm/geometric.hpp>
#include <iostream>

#include "deform/simulate/chainmail.h"
#include "deform/simulate/mass_spring.h"
#include "deform/simulate/scenario_run.h"
#include "io/dicom_series.h"
#include "io/scenario_file.h"
#include "itkbridge/itkVertexFieldResampleImageFilter.h"

namespace {

using ImageType = itk::Image<short, 3>;

/// The series with the most slices among those that make a volume.
const tetwarp::DicomSeries& choose(const tetwarp::DicomScan& scan, const std::string& folder) {
  const tetwarp::DicomSeries* chosen = nullptr;
  std::string refusal = "no DICOM series";
  for (const tetwarp::DicomSeries& series : scan.series) {
    if (series.refusal || series.uneven)
      refusal = series.refusal ? *series.refusal : *series.uneven;  // slices of an ITK image are even
    else if (!chosen || series.slices.size() > chosen->slices.size())
      chosen = &series;
  }
  tetwarp::require(chosen, folder + ": " + refusal);
  return *chosen;
}

/// The image that ITK makes of the files that it finds under a series UID.
ImageType::Pointer read_by_itk(const std::string& folder, const std::string& series_uid) {
  const auto names = itk::GDCMSeriesFileNames::New();
  names->SetUseSeriesDetails(false);
  names->RecursiveOn();
  names->SetDirectory(folder);
  const auto reader = itk::ImageSeriesReader<ImageType>::New();
  reader->SetImageIO(itk::GDCMImageIO::New());
  reader->SetFileNames(names->GetFileNames(series_uid));
  reader->Update();
  return reader->GetOutput();
}

void print(const char* reader, const tetwarp::Geometry& grid) {
  std::printf("%-13s %s voxels of %.6f x %.6f x %.6f mm, the first at (%.3f, %.3f, %.3f)\n", reader,
              tetwarp::to_string(grid.size).c_str(), grid.spacing.x, grid.spacing.y, grid.spacing.z, grid.origin.x,
              grid.origin.y, grid.origin.z);
}

/// The distance of corresponding corners of two grids of one size, mm; the largest of all corners.
double apart_mm(const tetwarp::Geometry& a, const tetwarp::Geometry& b) {
  double most = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 index =
        glm::dvec3(a.size - std::int64_t{1}) * glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2);
    most = std::max(most, glm::distance(tetwarp::point_from_index(a)(index), tetwarp::point_from_index(b)(index)));
  }
  return most;
}

/// Compares the voxels and the places of two volumes. @throws InputError unless all voxels are equal, and no corner is
/// further apart than a nanometre
void require_equal(const ImageType& by_itk, const ImageType& by_tetwarp) {
  const tetwarp::Geometry a = tetwarp::geometry_of(by_itk), b = tetwarp::geometry_of(by_tetwarp);
  print("ITK reads", a);
  print("Tetwarp reads", b);
  tetwarp::require(a.size == b.size, "ITK reads " + tetwarp::to_string(a.size) + " voxels of the series, Tetwarp " +
                                         tetwarp::to_string(b.size));
  const double apart = apart_mm(a, b);
  tetwarp::require(apart <= 1e-6, "ITK and Tetwarp place voxels up to " + std::to_string(apart) + " mm apart");
  const std::size_t count = by_itk.GetPixelContainer()->Size();
  std::size_t differing = 0;
  int most = 0;
  for (std::size_t n = 0; n < count; ++n) {
    const int off = std::abs(by_itk.GetBufferPointer()[n] - by_tetwarp.GetBufferPointer()[n]);
    differing += off != 0;
    most = std::max(most, off);
  }
  tetwarp::require(differing == 0, "ITK and Tetwarp differ in " + std::to_string(differing) + " of " +
                                       std::to_string(count) + " voxels, by up to " + std::to_string(most) + " HU");
  std::printf("equal: all %zu voxels, and where they lie\n", count);
}

/// Plays a scenario on a CT to its end and returns the field.
itk::VertexField::Pointer simulate(const ImageType& ct, const std::string& scenario_file) {
  using namespace tetwarp::simulate;
  const Scenario scenario = tetwarp::read_scenario(scenario_file);
  const tetwarp::Geometry grid = tetwarp::geometry_of(ct);
  const Patient patient = examine(tetwarp::view_of(ct, grid), nullptr, scenario.cell_size, scenario.body_above_hu);
  const bool is_chainmail = scenario.method == Method::chainmail;
  ScenarioRun run(scenario, patient, [&](const Model& model) {
    return is_chainmail ? make_cpu_chainmail(model) : make_cpu_mass_spring(model);
  });
  while (!run.is_done()) run.next();
  const auto field = itk::VertexField::New();
  field->SetField(run.field());
  return field;
}

void run(const std::string& folder, const std::string& scenario, const std::string& output) {
  const tetwarp::DicomScan scan = tetwarp::scan_dicom(folder);
  const tetwarp::DicomSeries& series = choose(scan, folder);
  tetwarp::DicomVolume dicom = tetwarp::load_dicom(series);
  const auto ct = tetwarp::image_of<ImageType>(tetwarp::AnyVolume(std::move(dicom.volume)));
  require_equal(*read_by_itk(folder, series.series_uid), *ct);

  const auto warp = itk::VertexFieldResampleImageFilter<ImageType>::New();
  warp->SetInput(ct);
  warp->SetVertexField(simulate(*ct, scenario));
  warp->SetDefaultPixelValue(-1024);  // air, for voxels where nothing comes to lie
  if (dicom.padding) warp->SetPadding(dicom.padding->low, dicom.padding->high);  // values outside the scanner's circle
  const auto median = itk::MedianImageFilter<ImageType, ImageType>::New();
  median->SetInput(warp->GetOutput());
  median->SetRadius(1);
  const auto writer = itk::ImageFileWriter<ImageType>::New();
  writer->SetInput(median->GetOutput());
  writer->SetFileName(output);
  writer->UseCompressionOn();
  writer->Update();
  // Needed since ITK's NIfTI writer does not throw.
  tetwarp::require(std::filesystem::exists(output), "cannot write " + output);

  const tetwarp::Report& report = warp->GetReport();
  std::printf(
      "warped on the %s: %llu voxels covered, %llu not, %llu of padding; %llu tetrahedra inside out; Jacobian "
      "%.3f to %.3f\n",
      warp->GetUsedBackend().c_str(), static_cast<unsigned long long>(report.covered),
      static_cast<unsigned long long>(report.uncovered), static_cast<unsigned long long>(report.padded),
      static_cast<unsigned long long>(report.inverted), report.jacobian_min, report.jacobian_max);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: tetwarp-example-dicom-pipeline DICOM_FOLDER SCENARIO.json OUTPUT.nii.gz\n";
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
  std::cerr << "tetwarp-example-dicom-pipeline: error: " << error << '\n';
  return 1;
}
