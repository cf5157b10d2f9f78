// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The figures of docs/reference/paper.md are those of the run that lies in bench/results/paper-h100.
#include "tests/bench/publish/publish.h"

namespace tetwarp::test {
namespace {

const std::filesystem::path kRun = kResults / "paper-h100/paper.json";
const std::filesystem::path kDocument = kSources / "docs/reference/paper.md";

using PaperDocument = Publish;

TEST_F(PaperDocument, HasTheFiguresOfItsRun) {
  const Outcome check = publish("--check " + quoted(kRun) + " " + quoted(kDocument));
  EXPECT_EQ(check.status, 0) << check.err;
}

TEST_F(PaperDocument, AChangedFigureIsFoundAndMended) {
  const std::string text = read_text(kDocument);
  const std::size_t row = text.find("| `paper` | ");
  ASSERT_NE(row, std::string::npos);
  std::string changed = text;
  changed.insert(row + 12, "9");
  write_file(scratch_ / "paper.md", changed);
  const Outcome check = publish("--check " + quoted(kRun) + " paper.md");
  EXPECT_EQ(check.status, 1);
  EXPECT_TRUE(says(check.err, {"paper.md has other figures than"}));
  EXPECT_EQ(read_text(scratch_ / "paper.md"), changed);
  EXPECT_EQ(publish("--fill " + quoted(kRun) + " paper.md").status, 0);
  EXPECT_EQ(read_text(scratch_ / "paper.md"), text);
}

TEST_F(PaperDocument, ANewRunFillsEveryPartOfIt) {
  ASSERT_EQ(
      run_tetwarp(scratch_.path(),
                  "paper --backend cpu --width 12 --slices 9,10 --cell-sizes 4 --frames 1 --warmup 0 --json new.json")
          .status,
      0);
  write_file(scratch_ / "paper.md", read_text(kDocument));
  const Outcome filled = publish("--fill new.json paper.md");
  ASSERT_EQ(filled.status, 0) << filled.err;
  const std::string text = read_text(scratch_ / "paper.md");
  EXPECT_TRUE(says(text, {"no GPU; commit", "| wave | (a) `inverse4x4-double` | 348.14 | 892.85 | - | - | - | - |",
                          "| twist | (b) `paper` | 23.82 | 90.78 |", "| leg, 600 | (b) `paper` | 127.19 |",
                          "| 2, (a) / (c) | bubble | 22.09 | 16.09 |", "| 2.010187 | 2.01017761 |", "not run here",
                          "| method | 9 | 10 |", "| bubble-paper-16 | "}));
  EXPECT_EQ(publish("--check new.json paper.md").status, 0);
}

TEST_F(PaperDocument, APartThatNobodyMakesIsNamed) {
  write_file(scratch_ / "paper.md", "<!-- paper.json: frames -->\n<!-- end -->\n");
  const Outcome run = publish("--fill " + quoted(kRun) + " paper.md");
  EXPECT_EQ(run.status, 1);
  EXPECT_TRUE(says(run.err, {"no part \"frames\"", "paper.md", "choose from"}));
}

}  // namespace
}  // namespace tetwarp::test
