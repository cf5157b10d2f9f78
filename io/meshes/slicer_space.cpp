// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/meshes/slicer_space.h"

#include <cctype>

#include "deform/errors.h"
#include "io/points/points_document.h"

namespace tetwarp {

void require_same_space(std::optional<PointFrame> before, PointFrame said, const std::string& name) {
  require(!before || *before == said, "both SPACE=LPS and SPACE=RAS, " + name);
}

std::optional<PointFrame> slicer_space(std::string_view text, const std::string& name) {
  constexpr std::string_view kKey = "SPACE=";
  std::optional<PointFrame> frame;
  for (auto at = text.find(kKey); at != std::string_view::npos; at = text.find(kKey, at)) {
    at += kKey.size();
    auto end = at;
    while (end < text.size() && std::isalnum(static_cast<unsigned char>(text[end]))) ++end;
    const std::string word(text.substr(at, end - at));
    require(word == "LPS" || word == "RAS", "the frame \"SPACE=" + word + "\", " + name + "; expected LPS or RAS");
    const PointFrame said = frame_of(word, name);
    require_same_space(frame, said, name);
    frame = said;
  }
  return frame;
}

}  // namespace tetwarp
