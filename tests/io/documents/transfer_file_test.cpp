// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/transfer_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "deform/errors.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

constexpr const char* kPoints =
    "\"points\": [\n"
    "  {\"value\": 0, \"colour\": \"#ff8000\", \"opacity\": 0},\n"
    "  {\"value\": 100.5, \"colour\": \"#000001\", \"opacity\": 0.25}\n"
    "]";

class TransferFiles : public testing::Test {
 protected:
  TransferFunction read(const std::string& text) const {
    write_file(scratch_ / "t.json", text);
    return read_transfer_file(scratch_ / "t.json");
  }
  /// What it says, without the folder; empty: it took it.
  std::string refusal(const std::string& text) const {
    try {
      read(text);
    } catch (const InputError& error) {
      const std::string all = error.what(), folder = scratch_.path().string() + "/";
      return all.starts_with(folder) ? all.substr(folder.size()) : all;
    }
    return "";
  }

  Scratch scratch_;
};

TEST_F(TransferFiles, EveryKeyIsRead) {
  const TransferFunction transfer =
      read(std::string("{\"name\": \"mine\", \"projection\": \"composite\", ") + kPoints +
           ", \"light\": {\"ambient\": 0.1, \"diffuse\": 0.2, \"specular\": 0.3, \"gradient\": 7}}");
  EXPECT_EQ(transfer.name, "mine");
  EXPECT_EQ(transfer.projection, Projection::composite);
  ASSERT_EQ(transfer.points.size(), 2u);
  EXPECT_EQ(transfer.points[1].value, 100.5);
  EXPECT_EQ(transfer.points[1].opacity, 0.25);
  EXPECT_EQ(transfer.points[0].colour, glm::dvec3(1, 128 / 255.0, 0));
  EXPECT_EQ(transfer.points[1].colour, glm::dvec3(0, 0, 1 / 255.0));
  EXPECT_EQ(transfer.ambient, 0.1);
  EXPECT_EQ(transfer.diffuse, 0.2);
  EXPECT_EQ(transfer.specular, 0.3);
  EXPECT_EQ(transfer.gradient, 7);
}

TEST_F(TransferFiles, WhatIsNotSaidIsTheDefault) {
  const TransferFunction transfer = read(std::string("{") + kPoints + "}");
  EXPECT_EQ(transfer.name, "t");
  EXPECT_EQ(transfer.projection, Projection::composite);
  EXPECT_EQ(transfer.gradient, TransferFunction().gradient);
}

TEST_F(TransferFiles, EachProjectionHasItsKeys) {
  const TransferFunction sum =
      read(R"({"projection": "sum", "white": 40, "points": [{"value": 0, "density": 0}, {"value": 1, "density": 9}]})");
  EXPECT_EQ(sum.projection, Projection::sum);
  EXPECT_EQ(sum.white, 40);
  EXPECT_EQ(sum.points[1].opacity, 9);
  const TransferFunction most = read(
      R"({"projection": "maximum", "points": [{"value": 0, "colour": "#000000"}, {"value": 1, "colour": "#ffffff"}]})");
  EXPECT_EQ(most.projection, Projection::maximum);
  EXPECT_EQ(most.points[1].colour, glm::dvec3(1));
}

TEST_F(TransferFiles, RefusesWithTheLine) {
  const auto with = [](const std::string& more) { return std::string("{") + kPoints + ",\n" + more + "}"; };
  EXPECT_TRUE(says(refusal(""), {"t.json:1"}));
  EXPECT_TRUE(says(refusal("[]"), {"t.json:1", "the transfer function is a list"}));
  EXPECT_TRUE(says(refusal("{}"), {"t.json:1", "no \"points\""}));
  EXPECT_TRUE(says(refusal(with("\"colour\": 3")), {"t.json:5", "colour"}));
  EXPECT_TRUE(says(refusal(with("\"projection\": \"mean\"")), {"t.json:5", "\"mean\"", "maximum"}));
  EXPECT_TRUE(says(refusal(with("\"white\": 3")), {"white", "sum only"}));
  EXPECT_TRUE(says(refusal(with("\"light\": {\"ambient\": -1}")), {"t.json:5", "light.ambient", "from 0 to 10"}));
  EXPECT_TRUE(
      says(refusal(R"({"projection": "sum", "points": [{"value": 0, "density": 0}, {"value": 1, "density": 9}]})"),
           {"no \"white\""}));
  EXPECT_TRUE(says(refusal("{\"points\": [{\"value\": 0, \"colour\": \"red\", \"opacity\": 0},\n {}]}"),
                   {"t.json:1", "points[0].colour", "#rrggbb"}));
  EXPECT_TRUE(
      says(refusal("{\"points\": [{\"value\": 0, \"colour\": \"#00000g\", \"opacity\": 0},\n {}]}"), {"#rrggbb"}));
  EXPECT_TRUE(says(refusal("{\"points\": [{\"value\": 0, \"colour\": \"#000000\", \"opacity\": 2},\n {}]}"),
                   {"points[0].opacity", "from 0 to 1"}));
  EXPECT_TRUE(says(refusal("{\"points\": [{\"value\": 0, \"colour\": \"#000000\", \"opacity\": 0},\n"
                           "{\"value\": 0, \"colour\": \"#000000\", \"opacity\": 0}]}"),
                   {"t.json:2", "points[1].value", "rise"}));
  EXPECT_TRUE(says(refusal("{\"points\": [{\"value\": 0, \"density\": 0}, {}]}"), {"points[0]", "density"}));
  EXPECT_THROW(read_transfer_file(scratch_ / "none.json"), InputError);
  EXPECT_THROW(read_transfer_file(scratch_.path()), InputError);
}

TEST_F(TransferFiles, ThoseOfTheExamplesAndOfTheDocumentAreGood) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(TETWARP_TRANSFER_FILES)) {
    EXPECT_NO_THROW(require_valid(read_transfer_file(entry.path()))) << entry.path();
    ++files;
  }
  EXPECT_GT(files, 0);
  std::ifstream file(TETWARP_RENDER_DOCUMENT);
  const std::string document{std::istreambuf_iterator<char>(file), {}};
  const std::size_t begin = document.find("\n    {\n"), end = document.find("\n    }\n", begin);
  ASSERT_NE(end, std::string::npos);
  EXPECT_EQ(refusal(document.substr(begin, end + 6 - begin)), "");
}

}  // namespace
}  // namespace tetwarp
