// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Registration by ITK, the warp by Tetwarp, and the same warp by ITK from the exact inverse.
//
//   tetwarp-example-register-and-warp FIXED MOVING OUTPUT_FOLDER
//
// The transform of a registration maps points of ITK's fixed image to its moving image. A vertex field goes with the
// anatomy: it says of a point of the image that is warped where it comes to lie. So the images are exchanged: MOVING,
// which is warped to look like FIXED, is ITK's fixed image. TransformToVertexFieldFilter samples the transform on a
// lattice over MOVING, and VertexFieldResampleImageFilter warps MOVING by that; no inverse is needed. What ITK's own
// ResampleImageFilter needs is the inverse, and VertexFieldToInverseDisplacementFieldFilter has it exactly. So both
// warps must agree; the program says how far they do, and ends with status 1 where a voxel differs by more than
// rounding.
//
// Pixels are float: of short ones ITK's filters cut the fraction off, Tetwarp rounds to nearest, and many would differ
// by one. Images of different scanners would first be aligned by a rigid or affine transform. Both warps are written:
// OUTPUT_FOLDER/warped.mha and warped_by_itk.mha.
#include <itkBinShrinkImageFilter.h>
#include <itkDisplacementFieldTransform.h>
#include <itkGaussianSmoothingOnUpdateDisplacementFieldTransform.h>
#include <itkGradientDescentOptimizerv4.h>
#include <itkImageFileReader.h>
#include <itkImageFileWriter.h>
#include <itkImageRegistrationMethodv4.h>
#include <itkMeanSquaresImageToImageMetricv4.h>
#include <itkRegistrationParameterScalesFromPhysicalShift.h>
#include <itkResampleImageFilter.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>

#include "itkbridge/itkTransformToVertexFieldFilter.h"
#include "itkbridge/itkVertexFieldResampleImageFilter.h"
#include "itkbridge/itkVertexFieldToInverseDisplacementFieldFilter.h"

namespace {

using ImageType = itk::Image<float, 3>;
using PullType = itk::DisplacementFieldTransform<float, 3>;

constexpr float kAir = -1000;        // HU
constexpr double kCoarseMm = 8;      // voxels of this size are registered
constexpr double kRoundingHu = 0.1;  // rounding of float coordinates, 2^-16 mm, on the steepest slope of a CT

ImageType::Pointer read(const std::string& path) {
  const auto reader = itk::ImageFileReader<ImageType>::New();
  reader->SetFileName(path);
  reader->Update();
  return reader->GetOutput();
}

void write(const ImageType* image, const std::filesystem::path& path) {
  const auto writer = itk::ImageFileWriter<ImageType>::New();
  writer->SetInput(image);
  writer->SetFileName(path.string());
  writer->Update();
}

ImageType::Pointer coarse(const ImageType* image) {
  const auto shrink = itk::BinShrinkImageFilter<ImageType, ImageType>::New();
  shrink->SetInput(image);
  for (unsigned axis = 0; axis < 3; ++axis)
    shrink->SetShrinkFactor(axis, std::max(1u, static_cast<unsigned>(kCoarseMm / image->GetSpacing()[axis] + 0.5)));
  shrink->Update();
  return shrink->GetOutput();
}

/// Registers two images. The result maps points of `from` to points of `to`: a displacement at each voxel of a coarse
/// grid, smoothed in every step.
itk::Transform<double, 3, 3>::Pointer register_images(const ImageType* from, const ImageType* to) {
  using TransformType = itk::GaussianSmoothingOnUpdateDisplacementFieldTransform<double, 3>;
  using MetricType = itk::MeanSquaresImageToImageMetricv4<ImageType, ImageType>;
  using RegistrationType = itk::ImageRegistrationMethodv4<ImageType, ImageType, TransformType>;
  const auto grid = TransformType::DisplacementFieldType::New();
  grid->CopyInformation(from);
  grid->SetRegions(from->GetLargestPossibleRegion());
  grid->Allocate(true);
  const auto transform = TransformType::New();
  transform->SetDisplacementField(grid);
  transform->SetGaussianSmoothingVarianceForTheUpdateField(3);  // voxels squared
  transform->SetGaussianSmoothingVarianceForTheTotalField(0.5);

  const auto metric = MetricType::New();
  const auto scales = itk::RegistrationParameterScalesFromPhysicalShift<MetricType>::New();
  scales->SetMetric(metric);
  const auto optimizer = itk::GradientDescentOptimizerv4::New();
  optimizer->SetScalesEstimator(scales);  // so that the first step moves no point further than a voxel
  optimizer->SetNumberOfIterations(50);
  optimizer->SetReturnBestParametersAndValue(true);

  const auto registration = RegistrationType::New();
  registration->SetFixedImage(from);
  registration->SetMovingImage(to);
  registration->SetMetric(metric);
  registration->SetOptimizer(optimizer);
  registration->SetInitialTransform(transform);
  registration->InPlaceOn();
  registration->SetNumberOfLevels(1);
  registration->SetSmoothingSigmasPerLevel(RegistrationType::SmoothingSigmasArrayType(1, 0.0));
  registration->Update();
  std::printf("registered on %s voxels: %u steps\n", tetwarp::to_string(tetwarp::geometry_of(*from).size).c_str(),
              static_cast<unsigned>(optimizer->GetCurrentIteration()));
  return transform.GetPointer();
}

double mean_squares(const ImageType& a, const ImageType& b) {
  const std::size_t count = a.GetPixelContainer()->Size();
  double sum = 0;
  for (std::size_t n = 0; n < count; ++n) sum += std::pow(a.GetBufferPointer()[n] - b.GetBufferPointer()[n], 2);
  return sum / static_cast<double>(count);
}

/// Prints how far the two warps agree. Where nothing comes to lie there is no inverse. ITK interpolates the inverse and
/// has no value beside such voxels either. Those voxels are counted, not compared.
/// @return whether all others agree to rounding
bool compare(const ImageType& by_tetwarp, const ImageType& by_itk, const PullType& pull) {
  const std::size_t count = by_itk.GetPixelContainer()->Size();
  std::size_t compared = 0, differing = 0;
  double most = 0, sum = 0;
  for (std::size_t n = 0; n < count; ++n) {
    PullType::InputPointType point;
    by_itk.TransformIndexToPhysicalPoint(by_itk.ComputeIndex(static_cast<itk::OffsetValueType>(n)), point);
    if (std::isnan(pull.TransformPoint(point)[0])) continue;
    const double apart = std::abs(by_tetwarp.GetBufferPointer()[n] - by_itk.GetBufferPointer()[n]);
    ++compared;
    differing += !(apart <= kRoundingHu);
    most = std::max(most, apart);
    sum += apart;
  }
  std::printf(
      "the warps differ by %.4f HU at most, %.6f in the mean of %zu voxels; %zu by more than rounding (%.1f HU); "
      "%zu voxels have no inverse\n",
      most, sum / static_cast<double>(compared), compared, differing, kRoundingHu, count - compared);
  return differing == 0;
}

bool run(const std::string& fixed_file, const std::string& moving_file, const std::filesystem::path& folder) {
  const auto fixed = read(fixed_file), moving = read(moving_file);
  tetwarp::require(tetwarp::same_grid(tetwarp::geometry_of(*fixed), tetwarp::geometry_of(*moving), 1e-3),
                   fixed_file + " and " + moving_file + " lie on different grids; resample one like the other first");
  const auto field = itk::TransformToVertexFieldFilter<>::New();
  field->SetTransform(register_images(coarse(moving), coarse(fixed)));
  field->SetReferenceImage(moving);
  field->SetCellSize(4);  // voxels between vertices
  const auto warp = itk::VertexFieldResampleImageFilter<ImageType>::New();
  warp->SetInput(moving);
  warp->SetVertexField(field->GetOutput());
  warp->SetDefaultPixelValue(kAir);
  warp->Update();

  const auto inverse = itk::VertexFieldToInverseDisplacementFieldFilter<>::New();
  inverse->SetVertexField(field->GetOutput());
  inverse->SetOutputParametersFromImage(moving);
  inverse->Update();
  const auto pull = PullType::New();
  pull->SetDisplacementField(inverse->GetOutput());
  const auto resample = itk::ResampleImageFilter<ImageType, ImageType, double, float>::New();
  resample->SetInput(moving);
  resample->SetTransform(pull);
  resample->SetOutputParametersFromImage(moving);
  resample->SetDefaultPixelValue(kAir);
  resample->Update();

  const tetwarp::Report& report = warp->GetReport();
  std::printf("field: Jacobian %.3f to %.3f, %llu tetrahedra inside out\n", report.jacobian_min, report.jacobian_max,
              static_cast<unsigned long long>(report.inverted));
  std::printf("mean squares to FIXED: %.1f of MOVING, %.1f warped, %.1f warped by ITK\n", mean_squares(*fixed, *moving),
              mean_squares(*fixed, *warp->GetOutput()), mean_squares(*fixed, *resample->GetOutput()));
  std::filesystem::create_directories(folder);
  write(warp->GetOutput(), folder / "warped.mha");
  write(resample->GetOutput(), folder / "warped_by_itk.mha");
  return compare(*warp->GetOutput(), *resample->GetOutput(), *pull);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: tetwarp-example-register-and-warp FIXED MOVING OUTPUT_FOLDER\n";
    return 2;
  }
  std::string error;
  try {
    return run(argv[1], argv[2], argv[3]) ? 0 : 1;
  } catch (const itk::ExceptionObject& thrown) {
    error = thrown.GetDescription();
  } catch (const std::exception& thrown) {
    error = thrown.what();
  }
  std::replace(error.begin(), error.end(), '\n', ' ');
  std::cerr << "tetwarp-example-register-and-warp: error: " << error << '\n';
  return 1;
}
