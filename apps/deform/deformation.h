// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/cli/shared_input.h"
#include "apps/deform/deform_report.h"
#include "apps/deform/deform_worker.h"
#include "backend/factories.h"

namespace tetwarp::apps {

/// One run of `deform`, stage by stage: open, read, make_field, resample, write, commit, in this order and each once.
/// Its outputs are begun when it is made, and removed with it unless it came to `commit`.
class Deformation {
 public:
  /// Refers to the options. @throws what begin_outputs throws
  explicit Deformation(const DeformOptions& options)
      : Deformation(options, std::make_shared<SharedInput>(options.input, SharedInput::Users::one)) {}
  /// @param input  of the options, which other runs may read as well
  Deformation(const DeformOptions& options, std::shared_ptr<SharedInput> input)
      : options_(options), record_(options), input_(std::move(input)) {}

  /// Reads headers, and plans. @throws what plan_deformation throws
  void open();
  void read();
  /// Reads, evaluates or simulates the field, and makes room for what comes out: all that needs no device, unless one
  /// simulates. @param worker  of a simulation
  void make_field(const Worker& worker);
  /// Resamples all that goes through the field; maps and the slices of a series are written meanwhile. Then looks at
  /// what the field is like, where the report says so.
  void resample(const Worker& worker);
  /// Writes what is not written yet, under hidden names.
  void write();
  /// Gives the outputs their names. Voxels and vertices are gone afterwards.
  void commit();

  const DeformRecord& record() const { return record_; }
  /// What people should know, "warning: ..." and "note: ...".
  std::vector<std::string> notes() const;

 private:
  void note_series(const DicomSeries& series);
  void check(ForwardResampler& resampler, const Control& control);
  void set_field(const AnyResampler& resampler, Outside outside, const Control& control) const;
  void resample_onto_own_grids(const Worker& worker);
  void move_structures(Resampler& resampler, Outside outside, const Control& control);
  void write_files();
  void write_field();
  void write_preview_picture();
  void write_slices(const Region& slices);
  Target main_target();
  std::optional<PaddingRange> padding_of_input() const;
  void scale_mass(const Region& slices);
  std::string title() const;

  const DeformOptions& options_;
  DeformRecord record_;
  std::shared_ptr<SharedInput> input_;
  double open_seconds_ = 0;
  std::vector<std::string> warnings_, file_notes_;
  struct {
    AnyVolume source, resampled;
    Maps maps;  ///< of the slab that is resampled
    std::atomic<std::uint64_t> saturated = 0;
  } mass_;  ///< with --preserve mass: in float
  std::vector<SliceRange> sampled_slices_;
  std::optional<DerivedSeriesWriter> series_;
};

}  // namespace tetwarp::apps
