// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <cmath>
#include <cstdio>
#include <span>

#include "apps/cli/markup.h"
#include "apps/score/score_report.h"
#include "deform/version.h"

namespace tetwarp::apps {

namespace {

std::string base64(std::span<const std::uint8_t> bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t n = 0; n < bytes.size(); n += 3) {
    std::uint32_t group = 0;
    for (std::size_t byte = 0; byte < 3; ++byte) group = group << 8 | (n + byte < bytes.size() ? bytes[n + byte] : 0u);
    for (std::size_t digit = 0; digit < 4; ++digit)
      text += n + digit > bytes.size() ? '=' : kDigits[group >> (18 - 6 * digit) & 63];
  }
  return text;
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

/// A value that is held against a limit; counts are whole numbers.
std::string number(const ScoreLimit& limit, double value) {
  const bool is_count = limit.name.ends_with("_voxels") && value == std::round(value);
  return is_count ? std::to_string(std::llround(value)) : number(value);
}

std::string cells(std::initializer_list<std::string> texts) {
  std::string row = "<tr>";
  for (const std::string& text : texts) row += "<td>" + text + "</td>";
  return row + "</tr>\n";
}

std::string errors_row(const std::string& part, const score::Errors& errors, const std::string& dice) {
  return cells({escaped(part), std::to_string(errors.points), std::to_string(errors.missing), number(errors.mean),
                number(errors.median), number(errors.percentile_95), number(errors.percentile_99),
                number(errors.largest), dice});
}

std::string verdict_of(bool passed) { return passed ? "<b class=\"pass\">passes</b>" : "<b class=\"fail\">fails</b>"; }

std::string case_section(const CaseScore& score) {
  std::string html =
      "<h2>" + escaped(score.name) + ", " + escaped(score.result) + ": " + verdict_of(score.passed()) + "</h2>\n";
  if (!score.failure.empty())
    return html + "<p class=\"note\">It cannot be scored: " + escaped(score.failure) + "</p>\n";
  if (score.file.empty()) return html + "<p>There is no result of this case.</p>\n";
  html += "<p class=\"file\">" + escaped(score.file.string()) + "</p>\n";
  for (const std::string& note : score.notes) html += "<p class=\"note\">" + escaped(note) + "</p>\n";
  html +=
      "<table><tr><th>part</th><th>points</th><th>missing</th><th>mean</th><th>median</th><th>95 %</th><th>99 "
      "%</th><th>largest</th><th>Dice</th></tr>\n";
  if (score.dense) html += errors_row("body", score.dense->all, "");
  for (const auto& [label, errors] : score.labels) {
    const auto overlap = score.overlaps.find(label);
    html += errors_row(label_name(score, label), errors,
                       overlap == score.overlaps.end() ? "" : number(overlap->second.dice()));
  }
  if (score.apart) html += errors_row("near the slip, not in the body above", *score.apart, "");
  for (const BandErrors& band : score.bands) html += errors_row(band_name(band), band.errors, "");
  if (score.landmarks) html += errors_row("landmarks", *score.landmarks, "");
  if (score.inverse_consistency) html += errors_row("inverse consistency", *score.inverse_consistency, "");
  for (const auto& [over, errors] : score.transitivity) html += errors_row("transitivity over " + over, errors, "");
  for (const auto& [label, errors] : score.surfaces)
    html += errors_row("surface of " + label_name(score, label), errors, "");
  html += "</table>\n";
  if (score.dense) {
    const score::DenseScore& dense = *score.dense;
    html += "<p>Without registration the body is off by " +
            number(dense.readings[static_cast<std::size_t>(score::Reading::nothing)]) +
            " mm in the mean. Jacobian determinants " + number(dense.smallest_determinant) + " to " +
            number(dense.largest_determinant) + ", " + std::to_string(dense.folded) + " of " +
            std::to_string(dense.determinants) + " voxels folded; they differ from the truth's by " +
            number(dense.mean_determinant_error) + " in the mean. The largest error lies at " +
            number(dense.all.worst.x) + ", " + number(dense.all.worst.y) + ", " + number(dense.all.worst.z) +
            " (LPS mm).</p>\n";
  }
  if (score.gamma)
    html += "<p>Dose: " + number(score.gamma->passing_percent()) + " % of " + std::to_string(score.gamma->points) +
            " voxels pass the global gamma index of 3 %, 2 mm, above 10 % of the largest dose, " +
            number(score.gamma->largest_dose) + ".</p>\n";
  html += "<table><tr><th>limit</th><th>found</th><th>most</th><th></th><th>source</th></tr>\n";
  for (const ScoreCheck& one : score.checks)
    html += cells({escaped(one.limit.about), number(one.limit, one.value), number(one.limit, one.limit.most),
                   verdict_of(one.passed()), escaped(one.limit.source)});
  html += "</table>\n";
  if (!score.picture.empty()) {
    html += "<figure><img alt=\"errors in a slice\" src=\"data:image/png;base64," + base64(score.picture) +
            "\"><figcaption>The axial slice with the largest error. Red grows with the error, up to 10 mm; blue: no "
            "place.</figcaption></figure>\n";
  }
  return html;
}

/// A table with a row for each case and a column for each result.
std::string overview(const std::vector<CaseScore>& scores) {
  std::string html =
      "<table><tr><th>case</th><th>result</th><th>body, mean</th><th>95 %</th><th>largest</th><th>landmarks, "
      "mean</th><th>largest</th><th></th></tr>\n";
  for (const CaseScore& score : scores) {
    const auto of = [&](const std::optional<score::Errors>& errors, double score::Errors::*member) {
      return errors ? number((*errors).*member) : std::string();
    };
    const std::optional<score::Errors> body = score.dense ? std::optional(score.dense->all) : std::nullopt;
    html += cells(
        {escaped(score.name), escaped(score.result), of(body, &score::Errors::mean),
         of(body, &score::Errors::percentile_95), of(body, &score::Errors::largest),
         of(score.landmarks, &score::Errors::mean), of(score.landmarks, &score::Errors::largest),
         score.failure.empty() && score.file.empty() ? "<b class=\"fail\">no result</b>" : verdict_of(score.passed())});
  }
  return html + "</table>\n";
}

}  // namespace

std::string page_of(const std::string& set, const std::vector<CaseScore>& scores,
                    const std::vector<ScoreLimit>& limits) {
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Errors of "
      "registrations</title>\n<style>\n"
      "body{font:15px/1.45 sans-serif;max-width:64em;margin:2em auto;padding:0 1em;color:#222}\n"
      "table{border-collapse:collapse;margin:.8em 0}td,th{border-bottom:1px solid #ccc;padding:.25em "
      ".7em;text-align:right}\n"
      "td:first-child,th:first-child,td:last-child{text-align:left}h2{margin-top:2em;border-top:1px solid "
      "#888;padding-top:.6em}\n"
      ".pass{color:#186a2b}.fail{color:#a3161a}.note{background:#fff3cd;padding:.4em .7em}.file{color:#666}\n"
      "img{max-width:100%}figcaption{color:#666}\n</style></head><body>\n<h1>Errors of registrations</h1>\n";
  html += "<p>Set: " + escaped(set) + ". Made by tetwarp " + escaped(version()) + " (" + escaped(commit()) +
          "). All lengths are mm. The error of a voxel is the distance between the place of the moving volume where "
          "the result "
          "leads its centre and the place where the true deformation does; voxels of the body count onto which the "
          "deformation leads something.</p>\n";
  html += overview(scores);
  html += "<p>Limits, where it was measured:</p>\n<ul>\n";
  for (const ScoreLimit& limit : limits)
    html += "<li>" + escaped(limit.about) + ": " +
            (limit.is_voxel_side ? "largest side of a voxel" : number(limit, limit.most)) + " (" +
            escaped(limit.source) + ")</li>\n";
  html += "</ul>\n";
  for (const CaseScore& score : scores) html += case_section(score);
  return html + "</body></html>\n";
}

}  // namespace tetwarp::apps
