// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>
#include <itkCastImageFilter.h>
#include <itkCommand.h>
#include <itkOutputWindow.h>
#include <itkPipelineMonitorImageFilter.h>
#include <itkStreamingImageFilter.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "backend/devices.h"
#include "itkbridge/itkDisplacementFieldToVertexFieldFilter.h"
#include "itkbridge/itkExactInvertDisplacementFieldImageFilter.h"
#include "itkbridge/itkPullFieldResampleImageFilter.h"
#include "itkbridge/itkVertexFieldResampleImageFilter.h"
#include "tests/itkbridge/filter_case.h"
#include "tests/support/says.h"

namespace tetwarp::test {
namespace {

using Filter = itk::VertexFieldResampleImageFilter<ShortImage>;
using FieldImage = itk::Image<itk::Vector<float, 3>, 3>;
using PullFilter = itk::PullFieldResampleImageFilter<ShortImage>;
using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

/// Calls a function for every event of a kind.
template <class TEvent>
void observe(itk::Object& object, std::function<void()> function) {
  object.AddObserver(TEvent(), [function = std::move(function)](const itk::EventObject&) { function(); });
}

Filter::Pointer warp_of(const ShortImage* image, const itk::VertexField* field) {
  const auto filter = Filter::New();
  filter->SetInput(image);
  filter->SetVertexField(field);
  filter->SetBackend("cpu");
  return filter;
}

/// A displacement image, forward or pull as who takes it says: the twist's displacements on the lattice of a volume.
FieldImage::Pointer displacement_image(const Geometry& volume, std::int64_t cell_size) {
  const VertexField field = twist(volume, 0.4, cell_size);
  const auto image = FieldImage::New();
  set_geometry(*image, field.lattice);
  image->SetRegions(image->GetLargestPossibleRegion());
  image->Allocate();
  std::memcpy(static_cast<void*>(image->GetBufferPointer()), field.displacement.data(),
              field.displacement.size() * sizeof(glm::vec3));
  return image;
}

/// Expects that a filter gives the same pixels in any number of slabs as in one run, and requests parts of its input
/// only.
template <class TFilter>
void expect_streams(TFilter& filter, const ShortImage* image) {
  filter.SetInput(image);
  filter.Update();
  const auto whole_image = ShortImage::Pointer(filter.GetOutput());
  whole_image->DisconnectPipeline();
  for (const unsigned divisions : {1u, 2u, 3u, 7u, 100u}) {
    const auto copy = itk::CastImageFilter<ShortImage, ShortImage>::New();  // copies the region that is requested
    const auto input = itk::PipelineMonitorImageFilter<ShortImage>::New();
    const auto streamer = itk::StreamingImageFilter<ShortImage, ShortImage>::New();
    copy->SetInput(image);
    copy->InPlaceOff();
    input->SetInput(copy->GetOutput());
    filter.SetInput(input->GetOutput());
    streamer->SetInput(filter.GetOutput());
    streamer->SetNumberOfStreamDivisions(divisions);
    streamer->Update();
    EXPECT_TRUE(same_pixels(*streamer->GetOutput(), *whole_image)) << divisions << " divisions";
    const auto& regions = input->GetUpdatedRequestedRegions();
    EXPECT_GE(regions.size(), std::min(divisions, 3u));  // fewer than divisions, for what is buffered is not made again
    if (divisions < 7) continue;
    const auto pixels = image->GetLargestPossibleRegion().GetNumberOfPixels();
    for (const auto& region : regions) EXPECT_LT(region.GetNumberOfPixels(), pixels / 2) << region;
  }
}

TEST(Pipeline, StreamDivisionsGiveTheSameBitsFromPartsOfTheInput) {
  const Geometry grid = turned_grid({24, 22, 80});
  const auto image = noise_image<ShortImage>(grid, {{3, -2, 9}});
  const auto filter = warp_of(image, twist_over(geometry_of(*image), 1, 0.1));
  expect_streams(*filter, image);
}

TEST(Pipeline, StreamDivisionsOfAPullFieldToo) {
  const Geometry grid = turned_grid({24, 22, 80});
  const auto image = noise_image<ShortImage>(grid);
  const auto filter = PullFilter::New();
  filter->SetDisplacementField(displacement_image(grid, 4));
  filter->SetBackend("cpu");
  expect_streams(*filter, image);
}

TEST(Pipeline, StreamDivisionsOfAnInverseGiveTheSameBits) {
  const auto forward = displacement_image(turned_grid({24, 22, 80}), 2);
  const auto invert = itk::ExactInvertDisplacementFieldImageFilter<FieldImage>::New();
  invert->SetInput(forward);
  invert->SetBackend("cpu");
  invert->Update();
  const auto whole_image = FieldImage::Pointer(invert->GetOutput());
  whole_image->DisconnectPipeline();
  const auto streamer = itk::StreamingImageFilter<FieldImage, FieldImage>::New();
  streamer->SetInput(invert->GetOutput());
  streamer->SetNumberOfStreamDivisions(5);
  streamer->Update();
  EXPECT_TRUE(same_pixels(*streamer->GetOutput(), *whole_image));
}

TEST(Pipeline, FieldThatNeedsNothingOfTheInputStreams) {
  const Geometry grid = turned_grid({10, 10, 10});
  const auto field = itk::VertexField::New();
  VertexField away{lattice_over(grid, 3), {}};
  away.displacement.assign(static_cast<std::size_t>(voxel_count(away.lattice)), glm::vec3(500, 0, 0));
  field->SetField(std::move(away));
  const auto filter = warp_of(noise_image<ShortImage>(grid), field);
  filter->SetDefaultPixelValue(-3);
  const auto streamer = itk::StreamingImageFilter<ShortImage, ShortImage>::New();
  streamer->SetInput(filter->GetOutput());
  streamer->SetNumberOfStreamDivisions(4);
  streamer->Update();
  for (std::int64_t n = 0; n < voxel_count(grid); ++n) ASSERT_EQ(streamer->GetOutput()->GetBufferPointer()[n], -3);
}

TEST(Pipeline, RunsOnlyWhenSomethingChanged) {
  const Geometry grid = turned_grid({12, 11, 10});
  const auto image = noise_image<ShortImage>(grid);
  const auto field = twist_over(grid, 3);
  const auto filter = warp_of(image, field);
  int runs = 0;
  observe<itk::StartEvent>(*filter, [&] { ++runs; });
  filter->Update();
  filter->Update();
  EXPECT_EQ(runs, 1);
  filter->SetInterpolation(Interpolation::linear);  // the value that it has already
  filter->SetBackend("cpu");
  filter->SetDevice(0);
  filter->Update();
  EXPECT_EQ(runs, 1);
  filter->SetInterpolation(Interpolation::nearest);
  filter->Update();
  EXPECT_EQ(runs, 2);
  image->GetBufferPointer()[7] = 5;
  image->Modified();
  filter->Update();
  EXPECT_EQ(runs, 3);
  const auto before = filter->GetOutput()->GetBufferPointer()[0];
  VertexField moved{lattice_over(grid, 3), {}};
  moved.displacement.assign(static_cast<std::size_t>(voxel_count(moved.lattice)), glm::vec3(0, 0, 400));
  filter->SetDefaultPixelValue(static_cast<short>(before + 1));
  field->SetField(std::move(moved));
  filter->Update();
  EXPECT_EQ(runs, 4);
  EXPECT_EQ(filter->GetOutput()->GetBufferPointer()[0], before + 1);
}

TEST(Pipeline, ChangesOfAFieldImageReachTheWarp) {
  const Geometry grid = turned_grid({12, 11, 10});
  const auto image = noise_image<ShortImage>(grid);
  const auto displacements = displacement_image(grid, 3);
  const auto source = itk::DisplacementFieldToVertexFieldFilter<>::New();
  source->SetInput(displacements);
  const auto forward = warp_of(image, source->GetOutput());
  const auto pull = PullFilter::New();
  pull->SetInput(image);
  pull->SetDisplacementField(displacements);
  pull->SetBackend("cpu");
  forward->Update();
  pull->Update();
  EXPECT_FALSE(same_pixels(*forward->GetOutput(), *image));
  EXPECT_FALSE(same_pixels(*pull->GetOutput(), *image));
  displacements->FillBuffer(FieldImage::PixelType(0.0f));
  displacements->Modified();
  forward->Update();
  pull->Update();
  EXPECT_TRUE(same_pixels(*forward->GetOutput(), *image));
  EXPECT_TRUE(same_pixels(*pull->GetOutput(), *image));
}

TEST(Pipeline, ProgressRisesFromZeroToOneInTheThreadOfTheCaller) {
  const Geometry grid = turned_grid({160, 150, 140});
  const auto filter = warp_of(noise_image<ShortImage>(grid), twist_over(grid, 1));
  std::vector<float> told;
  observe<itk::ProgressEvent>(*filter, [&, caller = std::this_thread::get_id()] {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    told.push_back(filter->GetProgress());
  });
  filter->Update();
  ASSERT_GE(told.size(), 4u);
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_EQ(told.front(), 0);
  EXPECT_EQ(told.back(), 1);
}

/// How long a filter works on after it was told to stop, ms. `abort` sets the flag and says when it did.
double ms_to_abort(Filter& filter, const std::atomic<Clock::time_point>& aborted) {
  try {
    filter.Update();
  } catch (const itk::ProcessAborted&) {
    return ms_since(aborted.load());
  }
  ADD_FAILURE() << "not aborted";
  return 0;
}

/// The shortest time of three runs, since other work of the machine counts, too.
double best_ms_to_abort(Filter& filter, const std::atomic<Clock::time_point>& aborted) {
  double best = INFINITY;
  for (int run = 0; run < 3; ++run) {
    filter.Modified();
    best = std::min(best, ms_to_abort(filter, aborted));
  }
  return best;
}

TEST(Pipeline, AbortEndsTheWorkSoonAndTheNextRunIsWhole) {
  const Geometry grid = turned_grid({256, 256, 200});
  const auto image = noise_image<ShortImage>(grid);
  const auto field = twist_over(grid, 1);
  const auto filter = warp_of(image, field);
  std::atomic<Clock::time_point> aborted;
  for (const float when : {0.1f, 0.3f, 0.6f}) {  // while the field is prepared, and while voxels are made
    const auto tag = filter->AddObserver(itk::ProgressEvent(), [&, when](const itk::EventObject&) {
      if (filter->GetProgress() < when || filter->GetAbortGenerateData()) return;
      aborted = Clock::now();
      filter->AbortGenerateDataOn();
    });
    EXPECT_LT(best_ms_to_abort(*filter, aborted), 100) << when;
    filter->RemoveObserver(tag);
  }
  filter->Update();
  EXPECT_TRUE(same_pixels(*filter->GetOutput(), *resampled_by_core(*image, grid, field->GetView())));
}

TEST(Pipeline, AbortMayComeFromAnotherThread) {
  const Geometry grid = turned_grid({256, 256, 200});
  const auto filter = warp_of(noise_image<ShortImage>(grid), twist_over(grid, 1));
  std::atomic<Clock::time_point> aborted;
  std::atomic<bool> begun = false, ended = false;
  observe<itk::ProgressEvent>(*filter, [&] { begun = filter->GetProgress() > 0; });
  std::thread other([&] {
    while (!ended) {
      if (begun.exchange(false) && !filter->GetAbortGenerateData()) {
        aborted = Clock::now();
        filter->AbortGenerateDataOn();
      }
      std::this_thread::yield();
    }
  });
  EXPECT_LT(best_ms_to_abort(*filter, aborted), 100);
  ended = true;
  other.join();
}

TEST(Pipeline, WhatAnObserverThrowsEndsTheRun) {
  const Geometry grid = turned_grid({128, 128, 100});
  const auto filter = warp_of(noise_image<ShortImage>(grid), twist_over(grid, 1));
  const auto tag = filter->AddObserver(itk::ProgressEvent(), [&](const itk::EventObject&) {
    if (filter->GetProgress() > 0) throw std::runtime_error("the window was closed");
  });
  EXPECT_THROW(filter->Update(), std::runtime_error);
  filter->RemoveObserver(tag);
  filter->Modified();
  EXPECT_EQ(itk_error_of([&] { filter->Update(); }), "");
}

TEST(Pipeline, WorkUnitsAreNoQuestionOfBits) {
  const Geometry grid = turned_grid({40, 38, 36});
  const auto image = noise_image<ShortImage>(grid);
  const auto field = twist_over(grid, 3);
  const auto expected = resampled_by_core(*image, grid, field->GetView());
  const auto filter = warp_of(image, field);
  for (const unsigned units : {1u, 2u, 3u, 64u}) {
    filter->SetNumberOfWorkUnits(units);
    filter->Update();
    EXPECT_TRUE(same_pixels(*filter->GetOutput(), *expected)) << units;
  }
  filter->SetNumberOfWorkUnits(64);
  EXPECT_EQ(threads_of(*filter), static_cast<int>(filter->GetMultiThreader()->GetMaximumNumberOfThreads()));
  filter->SetNumberOfWorkUnits(1);
  EXPECT_EQ(threads_of(*filter), 1);
}

/// A filter that is made of another: the warp, then nothing.
class Composite : public itk::ImageToImageFilter<ShortImage, ShortImage> {
 public:
  using Self = Composite;
  using Pointer = itk::SmartPointer<Self>;
  itkNewMacro(Self);
  itkTypeMacro(Composite, ImageToImageFilter);
  void set_field(itk::VertexField* field) { field_ = field; }

 protected:
  void GenerateData() override {
    this->AllocateOutputs();
    const auto warp = warp_of(this->GetInput(), field_);
    warp->GraftOutput(this->GetOutput());
    warp->Update();
    this->GraftOutput(warp->GetOutput());
  }

 private:
  itk::VertexField::Pointer field_;
};

TEST(Pipeline, GraftsIntoAFilterMadeOfFilters) {
  const Geometry grid = turned_grid({20, 19, 18});
  const auto image = noise_image<ShortImage>(grid);
  const auto field = twist_over(grid, 3);
  const auto composite = Composite::New();
  composite->SetInput(image);
  composite->set_field(field);
  composite->Update();
  EXPECT_TRUE(same_pixels(*composite->GetOutput(), *resampled_by_core(*image, grid, field->GetView())));
}

TEST(Pipeline, PrintShowsTheSettings) {
  const Geometry grid = turned_grid({12, 11, 10});
  const auto filter = warp_of(noise_image<ShortImage>(grid), twist_over(grid, 3));
  filter->SetDefaultPixelValue(-1024);
  filter->SetInterpolation(Interpolation::cubic);
  filter->SetPadding(-2000, -1500);
  filter->SetOutside(Outside::rest);
  filter->Update();
  std::ostringstream text;
  filter->Print(text);
  filter->GetVertexField()->Print(text);
  EXPECT_TRUE(says(text.str(), {"VertexFieldResampleImageFilter", "Interpolation: cubic", "DefaultPixelValue: -1024",
                                "Padding: -2000 to -1500", "Outside: rest", "Backend: cpu", "UsedBackend: cpu",
                                "Size: [0, 0, 0]", "Lattice: 5 x 5 x 4 vertices", "MeshTetrahedra: 0"}));
}

/// Collects what ITK would show as warnings.
class Warnings : public itk::OutputWindow {
 public:
  using Self = Warnings;
  using Pointer = itk::SmartPointer<Self>;
  itkNewMacro(Self);
  void DisplayWarningText(const char* text) override { shown.emplace_back(text); }
  std::vector<std::string> shown;
};

TEST(Pipeline, AutoFallsBackToTheCpuWithOneWarningAndCudaByNameThrows) {
  if (device_count() > 0) GTEST_SKIP() << "a CUDA device works here";
  const Geometry grid = turned_grid({12, 11, 10});
  const auto image = noise_image<ShortImage>(grid);
  const auto field = twist_over(grid, 3);
  const auto before = itk::OutputWindow::GetInstance();
  const auto warnings = Warnings::New();
  itk::OutputWindow::SetInstance(warnings);
  for (int n = 0; n < 2; ++n) {
    const auto filter = warp_of(image, field);
    filter->SetBackend("auto");
    filter->Update();
    EXPECT_EQ(filter->GetUsedBackend(), "cpu");
    EXPECT_TRUE(same_pixels(*filter->GetOutput(), *resampled_by_core(*image, grid, field->GetView())));
  }
  const auto by_name = warp_of(image, field);
  by_name->SetBackend("cuda");
  EXPECT_NE(itk_error_of([&] { by_name->Update(); }), "");
  itk::OutputWindow::SetInstance(before);
  ASSERT_EQ(warnings->shown.size(), 1u);
  EXPECT_TRUE(says(warnings->shown[0], {"works on the CPU", "the bits are the same", "CUDA"}));
}

TEST(Pipeline, AutoFallsBackToTheCpuWhereTheDeviceFails) {
  if (device_count() == 0) GTEST_SKIP() << "no CUDA device on this machine";
  const Geometry grid = turned_grid({12, 11, 10});
  const auto image = noise_image<ShortImage>(grid);
  const auto field = twist_over(grid, 3);
  const auto filter = warp_of(image, field);
  filter->SetBackend("auto");
  filter->SetDevice(device_count());  // is not there
  filter->Update();
  EXPECT_EQ(filter->GetUsedBackend(), "cpu");
  EXPECT_TRUE(same_pixels(*filter->GetOutput(), *resampled_by_core(*image, grid, field->GetView())));
  filter->SetBackend("cuda");
  EXPECT_NE(itk_error_of([&] { filter->Update(); }), "");
}

TEST(Pipeline, CudaGivesTheBitsOfTheCpu) {
  if (device_count() == 0) GTEST_SKIP() << "no CUDA device on this machine";
  const Geometry grid = turned_grid({60, 58, 56});
  const auto image = noise_image<ShortImage>(grid);
  const auto field = twist_over(grid, 3);
  const auto filter = warp_of(image, field);
  filter->SetBackend("cuda");
  filter->Update();
  EXPECT_EQ(filter->GetUsedBackend(), "cuda");
  EXPECT_TRUE(same_pixels(*filter->GetOutput(), *resampled_by_core(*image, grid, field->GetView())));
  expect_streams(*filter, image);
}

}  // namespace
}  // namespace tetwarp::test
