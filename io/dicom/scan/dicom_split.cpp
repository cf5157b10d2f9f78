// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/scan/dicom_split.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <optional>

#include "io/dicom/scan/dicom_kind.h"
#include "io/dicom/scan/dicom_stack.h"
#include "io/dicom/scan/dicom_traits.h"
#include "io/dicom_series.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

using Headers = std::vector<DicomFileHeader>;
using Positions = std::vector<double>;

constexpr std::size_t kFewestSlices = 3, kMostVolumes = 500;

/// Slices of one kind, sorted along their normal.
struct Stack {
  Headers files;
  Positions positions;  ///< along the normal, mm
};

Stack sorted_stack(Headers files) {
  const glm::dvec3 normal = rotation_of(*files.front().orientation)[2];
  const auto along = [&](const DicomFileHeader& header) { return glm::dot(*header.position, normal); };
  std::stable_sort(files.begin(), files.end(), [&](const auto& a, const auto& b) { return along(a) < along(b); });
  Stack stack{std::move(files), {}};
  for (const DicomFileHeader& header : stack.files) stack.positions.push_back(along(header));
  return stack;
}

bool is_crowded(const Positions& positions) {
  return std::adjacent_find(positions.begin(), positions.end(),
                            [](double a, double b) { return b - a <= kSamePosition; }) != positions.end();
}

bool is_uneven(const Positions& positions) {
  const double usual = median_gap(positions);
  for (std::size_t k = 1; k < positions.size(); ++k) {
    if (std::abs(positions[k] - positions[k - 1] - usual) > 0.01 * usual) return true;
  }
  return false;
}

/// A way to divide slices into groups, by something of which each slice has one value.
struct Divider {
  std::string name;
  std::vector<std::size_t> group_of;  ///< by slice of the stack: its group
  std::size_t groups = 0;             ///< how many groups there are; they are numbered in their natural order
  std::function<std::vector<std::string>()> labels = {};  ///< makes one label a group
};

Divider divider_of(Trait trait, const Headers& files) {
  std::map<std::string_view, std::vector<std::size_t>> slices_of;
  for (std::size_t n = 0; n < files.size(); ++n) slices_of[trait_of(files[n], trait)].push_back(n);
  std::vector<std::string_view> values;
  for (const auto& [value, slices] : slices_of) values.push_back(value);
  std::stable_sort(values.begin(), values.end(), [&](auto a, auto b) { return is_before(trait, a, b); });
  Divider divider{name_of(trait), std::vector<std::size_t>(files.size()), values.size()};
  std::vector<const DicomFileHeader*> examples;
  for (std::size_t group = 0; group < values.size(); ++group) {
    const std::vector<std::size_t>& slices = slices_of[values[group]];
    for (const std::size_t n : slices) divider.group_of[n] = group;
    examples.push_back(&files[slices.front()]);
  }
  divider.labels = [trait, examples] { return labels_of(trait, examples); };
  return divider;
}

Divider divider_by_folder(const Headers& files) {
  std::map<std::filesystem::path, std::size_t> folders;
  for (const DicomFileHeader& header : files) folders.try_emplace(header.file.parent_path(), 0);
  std::vector<std::string> labels;
  for (auto& [folder, group] : folders) {
    group = labels.size();
    labels.push_back("folder " + shown(folder));
  }
  Divider divider{"the folder", {}, folders.size(), [labels] { return labels; }};
  for (const DicomFileHeader& header : files) divider.group_of.push_back(folders[header.file.parent_path()]);
  return divider;
}

/// Divides slices by runs of Instance Number: numbers that run through all positions in order, then again. If numbers
/// count first at one position, they tell which slice came first there, not which belong together, and divide nothing.
Divider divider_by_runs(const Stack& stack) {
  const std::size_t count = stack.files.size();
  Divider divider{"Instance Number (0020,0013)", std::vector<std::size_t>(count), 1};
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), 0);
  const auto number = [&](std::size_t n) { return stack.files[n].instance_number; };
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return number(a) < number(b); });
  std::vector<std::pair<int, int>> runs;
  double direction = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double step = i == 0 ? 0 : stack.positions[order[i]] - stack.positions[order[i - 1]];
    if (i > 0 && number(order[i]) == number(order[i - 1])) return divider;
    if (i == 0 || std::abs(step) <= kSamePosition || step * direction < 0) {
      runs.emplace_back(number(order[i]), 0);
      direction = 0;
    } else {
      direction = step;
    }
    runs.back().second = number(order[i]);
    divider.group_of[order[i]] = runs.size() - 1;
  }
  divider.groups = runs.size();
  divider.labels = [runs] {
    std::vector<std::string> labels;
    for (const auto& [first, last] : runs)
      labels.push_back("images " + std::to_string(first) + " to " + std::to_string(last));
    return labels;
  };
  return divider;
}

Divider both(const Divider& a, const Divider& b) {
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> pairs;
  for (std::size_t n = 0; n < a.group_of.size(); ++n) pairs.try_emplace({a.group_of[n], b.group_of[n]}, 0);
  Divider divider{a.name + " and " + b.name, {}, pairs.size()};
  std::size_t next = 0;
  for (auto& [pair, group] : pairs) group = next++;
  for (std::size_t n = 0; n < a.group_of.size(); ++n) divider.group_of.push_back(pairs[{a.group_of[n], b.group_of[n]}]);
  divider.labels = [pairs, of_a = a.labels, of_b = b.labels] {
    const std::vector<std::string> left = of_a(), right = of_b();
    std::vector<std::string> labels;
    for (const auto& [pair, group] : pairs) labels.push_back(left[pair.first] + ", " + right[pair.second]);
    return labels;
  };
  return divider;
}

std::vector<Positions> positions_by_group(const Stack& stack, const Divider& divider) {
  std::vector<Positions> groups(divider.groups);
  for (std::size_t n = 0; n < stack.positions.size(); ++n) groups[divider.group_of[n]].push_back(stack.positions[n]);
  return groups;
}

std::vector<Headers> files_by_group(Headers files, const Divider& divider) {
  std::vector<Headers> groups(divider.groups);
  for (std::size_t n = 0; n < files.size(); ++n) groups[divider.group_of[n]].push_back(std::move(files[n]));
  return groups;
}

bool same_positions(const Positions& a, const Positions& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](double x, double y) { return std::abs(x - y) <= kSamePosition; });
}

bool overlap(const Positions& a, const Positions& b) { return a.front() <= b.back() && b.front() <= a.back(); }

/// Whether `b` begins where `a` ends, as if they were one stack.
bool goes_on(const Positions& a, const Positions& b) {
  const double usual = median_gap(a), gap = b.front() - a.back();
  return std::abs(gap - usual) <= 0.01 * usual && std::abs(median_gap(b) - usual) <= 0.01 * usual;
}

enum class Verdict : std::uint8_t { no, volumes, volumes_of_same_positions };

struct Judgement {
  Verdict verdict = Verdict::no;
  std::string reason = {};  ///< why, if the verdict is no
};

std::size_t regular_stacks(const Headers& files, const Divider& divider) {
  std::size_t count = 0;
  for (Headers& group : files_by_group(files, divider)) {
    DicomSeries series;
    count += stack_slices(group, series) || series.uneven ? 0 : 1;
  }
  return count;
}

Judgement judge(const Stack& stack, const Divider& divider, bool crowded) {
  if (divider.groups > kMostVolumes) return {Verdict::no, "has " + std::to_string(divider.groups) + " values"};
  const std::vector<Positions> groups = positions_by_group(stack, divider);
  if (std::any_of(groups.begin(), groups.end(), is_crowded)) return {Verdict::no, "leaves slices at one position"};
  const auto is_first = [&](const Positions& group) { return same_positions(group, groups.front()); };
  if (std::all_of(groups.begin(), groups.end(), is_first)) return {Verdict::volumes_of_same_positions};
  const auto fewest =
      std::min_element(groups.begin(), groups.end(), [](const auto& a, const auto& b) { return a.size() < b.size(); });
  if (fewest->size() < kFewestSlices)
    return {Verdict::no, fewest->size() == 1 ? "gives a volume of one slice" : "gives a volume of two slices"};
  for (const Positions& group : groups) {
    const auto overlaps = [&](const Positions& other) { return &other != &group && overlap(group, other); };
    if (std::none_of(groups.begin(), groups.end(), overlaps)) return {Verdict::no, "gives blocks that do not overlap"};
    const auto continues = [&](const Positions& other) { return &other != &group && goes_on(group, other); };
    if (std::any_of(groups.begin(), groups.end(), continues)) return {Verdict::no, "gives pieces of a volume"};
  }
  const std::size_t regular = regular_stacks(stack.files, divider);
  const bool enough = crowded ? 2 * regular >= groups.size() : regular == groups.size();
  if (enough) return {Verdict::volumes};
  return {Verdict::no, "gives " + std::to_string(groups.size() - regular) + " irregular volumes"};
}

/// Keeps the best of the dividers that are offered, by the rule of `split_volumes`.
class Choice {
 public:
  Choice(const Stack& stack, bool crowded) : stack_(stack), crowded_(crowded) {}

  void offer(const Divider& divider) {
    // If the best one gives volumes of the same positions, it gives the fewest possible.
    if (best_ && divider.groups >= best_->groups) return;
    const Judgement judgement = judge(stack_, divider, crowded_);
    if (judgement.verdict == Verdict::no)
      reasons_.push_back(divider.name + " " + judgement.reason);
    else
      best_ = divider;
  }
  const std::optional<Divider>& best() const { return best_; }
  /// Why each of the other dividers was not taken.
  const std::vector<std::string>& reasons() const { return reasons_; }

 private:
  const Stack& stack_;
  bool crowded_;
  std::optional<Divider> best_;
  std::vector<std::string> reasons_;
};

/// The attributes, and the folder, that have several values among the slices, as dividers.
std::vector<Divider> dividers_of(const Stack& stack) {
  std::vector<Divider> dividers;
  for (std::size_t n = 0; n < kTraits; ++n) dividers.push_back(divider_of(static_cast<Trait>(n), stack.files));
  dividers.push_back(divider_by_folder(stack.files));
  std::erase_if(dividers, [](const Divider& divider) { return divider.groups == 1; });
  return dividers;
}

std::optional<Divider> best_pair(const Stack& stack, const std::vector<Divider>& dividers) {
  Choice choice(stack, true);
  const auto is_coarse = [&](const Divider& one) { return one.groups * kFewestSlices <= stack.files.size(); };
  for (auto a = dividers.begin(); a != dividers.end(); ++a) {
    for (auto b = a + 1; b < dividers.end(); ++b) {
      if (is_coarse(*a) && is_coarse(*b)) choice.offer(both(*a, *b));
    }
  }
  return choice.best();
}

std::string text_of(const std::vector<std::string>& reasons) {
  constexpr std::size_t kMost = 4;
  if (reasons.empty()) return "no attribute that may tell volumes apart differs between them";
  std::string text;
  for (std::size_t n = 0; n < std::min(reasons.size(), kMost); ++n) text += (n == 0 ? "" : ", ") + reasons[n];
  if (reasons.size() > kMost) text += ", and " + std::to_string(reasons.size() - kMost) + " other attributes likewise";
  return text;
}

std::vector<SplitVolume> one_volume(Headers files) {
  std::vector<SplitVolume> volumes;
  volumes.push_back({std::move(files)});
  return volumes;
}

std::vector<SplitVolume> divide(Headers files, const Divider& divider) {
  const std::vector<std::string> labels = divider.labels();
  std::vector<Headers> groups = files_by_group(std::move(files), divider);
  std::vector<SplitVolume> volumes;
  for (std::size_t n = 0; n < groups.size(); ++n) volumes.push_back({std::move(groups[n]), labels[n], divider.name});
  return volumes;
}

/// The volumes of slices of one kind.
std::vector<SplitVolume> split_stack(Headers files) {
  if (files.size() < 2) return one_volume(std::move(files));
  Stack stack = sorted_stack(std::move(files));
  const bool crowded = is_crowded(stack.positions);
  if (!crowded && !is_uneven(stack.positions)) return one_volume(std::move(stack.files));
  const std::vector<Divider> dividers = dividers_of(stack);
  Choice choice(stack, crowded);
  for (const Divider& divider : dividers) choice.offer(divider);
  if (choice.best()) return divide(std::move(stack.files), *choice.best());
  if (!crowded) return one_volume(std::move(stack.files));
  if (const auto pair = best_pair(stack, dividers)) return divide(std::move(stack.files), *pair);
  const Divider runs = divider_by_runs(stack);
  const bool long_enough = runs.groups > 1 && stack.files.size() >= kFewestSlices * runs.groups;
  if (long_enough && judge(stack, runs, crowded).verdict == Verdict::volumes_of_same_positions)
    return divide(std::move(stack.files), runs);
  std::vector<SplitVolume> volumes = one_volume(std::move(stack.files));
  volumes.front().tried = text_of(choice.reasons());
  return volumes;
}

}  // namespace

std::vector<SplitVolume> split_volumes(Headers files) {
  const std::vector<SliceKind> kinds = slice_kinds(files);
  if (kinds.size() == 1) return split_stack(std::move(files));
  const auto is_enough = [](const SliceKind& kind) { return kind.slices.size() >= kFewestSlices; };
  if (kinds.empty() || !std::all_of(kinds.begin(), kinds.end(), is_enough)) return one_volume(std::move(files));
  std::vector<SplitVolume> volumes;
  for (const SliceKind& kind : kinds) {
    Headers of_kind;
    for (const std::size_t n : kind.slices) of_kind.push_back(std::move(files[n]));
    for (SplitVolume& volume : split_stack(std::move(of_kind))) {
      volume.label = kind.label + (volume.label.empty() ? "" : ", " + volume.label);
      volume.split_by = kind.differ_by + (volume.split_by.empty() ? "" : " and " + volume.split_by);
      volumes.push_back(std::move(volume));
    }
  }
  return volumes;
}

}  // namespace tetwarp
