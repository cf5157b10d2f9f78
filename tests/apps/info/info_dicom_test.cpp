// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What `tetwarp info FOLDER` says, and how --series takes what it offers.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <nlohmann/json.hpp>

#include "tests/support/dicom/dicom_edit.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/dicom/enhanced_maker.h"
#include "tests/support/program.h"
#include "tests/support/real_data.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Three phases of five slices with a scout and a note, in the folder "in".
void write_phases(const Scratch& scratch) {
  for (const int phase : {0, 50, 100}) {
    write_stack(scratch / "in" / std::to_string(phase), 5, [phase](int k, MadeSlice& slice) {
      slice.sop_instance = "1.2.3." + std::to_string(phase) + "." + std::to_string(k);
      slice.words = {static_cast<std::uint16_t>(phase)};
      slice.edit = [phase](DcmDataset& data) {
        data.putAndInsertString(DCM_SeriesDescription, ("Gated, " + std::to_string(phase) + "%").c_str());
      };
    });
  }
  MadeSlice scout;
  scout.image_type = "ORIGINAL\\PRIMARY\\LOCALIZER";
  scout.sop_instance = "1.2.3.9.9";
  write_slice(scratch / "in/scout.dcm", scout);
  write_file(scratch / "in/notes.txt", "not an image at all");
}

TEST(InfoOfDicom, SaysInWordsWhatIsThereAndHowToTakeIt) {
  const Scratch scratch;
  write_phases(scratch);
  const Outcome run = run_tetwarp(scratch.path(), "info in");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(run.err, "") << "no progress bar but on a terminal";
  EXPECT_TRUE(says(
      run.out,
      {"in: 17 files, 3 of 3 entries can be deformed", "holds 3 volumes, told apart by Series Description (0008,103E):",
       "  1  phase 0 %:  CT, 6 x 4, 5 slices, 2.5 mm apart, axial; head to feet 10 mm", "  3  phase 100 %:  CT",
       "voxels 0.5 x 0.75 x 2.5 mm", "set aside, no part of the volume:", "1 file: a localizer (scout)", "in/scout.dcm",
       "Other files, no DICOM images:", "in/notes.txt",
       "To deform one: tetwarp deform in --series 1 -f FIELD -o OUTPUT"}));
  EXPECT_EQ(run.out.find("SECRET"), std::string::npos);
  EXPECT_EQ(run.out.find("scout.dcm"), run.out.rfind("scout.dcm")) << "once, not with every phase";
}

TEST(InfoOfDicom, JsonHasTheKeysThatTheDocumentsPromise) {
  const Scratch scratch;
  write_phases(scratch);
  const json said = json::parse(run_tetwarp(scratch.path(), "info in --json").out);
  std::vector<std::string> keys, of_series;
  for (const auto& [key, value] : said.items()) keys.push_back(key);
  EXPECT_EQ(keys, (std::vector<std::string>{"files", "hint", "kind", "path", "series", "skipped"}));
  EXPECT_EQ(said["files"], 17);
  EXPECT_EQ(said["skipped"][0]["count"], 1);
  EXPECT_EQ(said["skipped"][0]["files"], json::array({"in/notes.txt"}));
  ASSERT_EQ(said["series"].size(), 3u);
  const json& second = said["series"][1];
  for (const auto& [key, value] : second.items()) of_series.push_back(key);
  EXPECT_EQ(of_series, (std::vector<std::string>{"description", "files", "frame_of_reference_uid", "geometry", "label",
                                                 "modality", "number", "series_instance_uid", "series_number",
                                                 "set_aside", "slices", "split_by", "study_instance_uid", "summary",
                                                 "usable", "volumes_in_series", "warnings"}));
  EXPECT_EQ(second["number"], 2);
  EXPECT_EQ(second["label"], "phase 50 %");
  EXPECT_EQ(second["split_by"], "Series Description (0008,103E)");
  EXPECT_EQ(second["volumes_in_series"], 3);
  EXPECT_EQ(second["description"], "Gated, 50%");
  EXPECT_EQ(second["series_instance_uid"], "1.2.3");
  EXPECT_EQ(said["series"][0]["set_aside"][0]["files"], json::array({"in/scout.dcm"}));
  EXPECT_EQ(second["set_aside"], json::array()) << "with the first volume of the series";
  EXPECT_EQ(second["geometry"]["size"], json::array({6, 4, 5}));
  EXPECT_EQ(said.dump().find("SECRET"), std::string::npos);
}

TEST(InfoOfDicom, FramesOfOneFileAreSlicesThatItHolds) {
  const Scratch scratch;
  MadeEnhanced made;
  made.edit_groups = [](int k, DcmItem& groups) {
    if (k == 0)
      macro_of(groups, DCM_CTImageFrameTypeSequence)
          .putAndInsertString(DCM_FrameType, "ORIGINAL\\PRIMARY\\LOCALIZER\\NONE");
  };
  made.write(scratch / "in/all.dcm", classic_stack(6));
  EXPECT_TRUE(says(run_tetwarp(scratch.path(), "info in").out,
                   {"in: 1 file, 1 of 1 entries", "5 slices in 1 file, 2.5 mm apart, axial",
                    "1 frame: a localizer (scout)", "in/all.dcm, frame 1\n"}));
  const json said = json::parse(run_tetwarp(scratch.path(), "info in --json").out)["series"][0];
  EXPECT_EQ(said["slices"], 5);
  EXPECT_EQ(said["files"], 1);
  EXPECT_EQ(said["set_aside"][0]["files"], json::array({"in/all.dcm, frame 1"}));
}

TEST(InfoOfDicom, ARefusedSeriesSaysWhyAndThatNothingIsLeft) {
  const Scratch scratch;
  write_stack(scratch / "in", 5, [](int k, MadeSlice& slice) {
    if (k == 2) slice.position = position_text(40, -20, 5);
  });
  const Outcome run = run_tetwarp(scratch.path(), "info in");
  EXPECT_TRUE(says(run.out, {"in: 5 files, 0 of 1 entries", "cannot be used: slices are not stacked on one line",
                             "choose the slices of one stack", "Nothing here can be deformed."}));
  const json said = json::parse(run_tetwarp(scratch.path(), "info in --json").out);
  EXPECT_EQ(said["series"][0]["usable"], false);
  EXPECT_FALSE(said["series"][0].contains("geometry"));
  EXPECT_EQ(said["hint"], "");
}

TEST(InfoOfDicom, AMissingSliceIsNamedWithTheOptionThatTakesTheRest) {
  const Scratch scratch;
  write_stack(scratch / "in", 6);
  fs::remove(scratch / "in/s03.dcm");
  const Outcome run = run_tetwarp(scratch.path(), "info in");
  EXPECT_TRUE(says(run.out, {"in: 5 files, 1 of 1 entries", "5 slices, unevenly spaced", "uneven: slice gap 5 mm",
                             "1 slice missing", "needs --uneven exact"}));
  const json said = json::parse(run_tetwarp(scratch.path(), "info in --json").out);
  EXPECT_EQ(said["series"][0]["usable"], true);
  EXPECT_TRUE(says(said["series"][0]["uneven"], {"slice gap 5 mm"}));
  EXPECT_EQ(said["hint"], "tetwarp deform in --uneven exact -f FIELD -o OUTPUT");
}

TEST(InfoOfDicom, OneVolumeNeedsNoNumberAndAPathIsQuotedForTheShell) {
  const Scratch scratch;
  write_stack(scratch / "a folder's", 4);
  const json said = json::parse(run_tetwarp(scratch.path(), "info \"a folder's\" --json").out);
  const std::string hint = said["hint"];
  EXPECT_EQ(hint, "tetwarp deform 'a folder'\\''s' -f FIELD -o OUTPUT");
  std::string command = hint.substr(std::string("tetwarp ").size());
  command.replace(command.find("FIELD"), 5, "identity").replace(command.find("OUTPUT"), 6, "out.nii");
  EXPECT_EQ(run_tetwarp(scratch.path(), command).status, 0) << "the hint works as it stands";
}

TEST(SeriesOption, TakesTheNumberThatInfoPrintsAndTheUidOfASeriesOfOneVolume) {
  const Scratch scratch;
  write_phases(scratch);
  const Outcome none = run_tetwarp(scratch.path(), "deform in -f identity -o out.nii");
  EXPECT_EQ(none.status, 4);
  EXPECT_TRUE(says(none.err, {"tetwarp: error: 3 volumes found, in; choose one with --series\n",
                              "\n  2  1.2.3  CT  phase 50 %  5 slices  6 x 4 x 5"}));
  const Outcome uid = run_tetwarp(scratch.path(), "deform in --series 1.2.3 -f identity -o out.nii");
  EXPECT_EQ(uid.status, 4);
  EXPECT_TRUE(says(uid.err, {"the series 1.2.3 holds 3 volumes, in; choose one by its number\n  1  ", "phase 100 %"}));
  EXPECT_FALSE(fs::exists(scratch / "out.nii"));
  ASSERT_EQ(run_tetwarp(scratch.path(), "deform in --series 2 -f identity -o out.nii").status, 0);
  const json sidecar = json::parse(read_text(scratch / "out.nii.json"));
  EXPECT_EQ(sidecar["input"]["volume"], "phase 50 %");
  ASSERT_EQ(sidecar["input"]["set_aside"].size(), 1u);
  write_stack(scratch / "in/other", 3, [](int, MadeSlice& slice) { slice.series = "1.2.4"; });
  EXPECT_EQ(run_tetwarp(scratch.path(), "deform in --series 1.2.4 -f identity -o other.nii").status, 0);
}

TEST(SeriesOption, SlicesOfOnePhaseAloneCannotBeDeformed) {
  TETWARP_REAL_DATA(folder, "slice-errors/same-position");
  const Scratch scratch;
  const Outcome info = run_tetwarp(scratch.path(), "info '" + folder.string() + "'");
  EXPECT_TRUE(says(info.out, {"holds 4 volumes, told apart by Acquisition Number (0020,0012):",
                              "acquisition 12:  CT, 512 x 512, 1 slice, axial",
                              "cannot be deformed: one slice has no cells", "Nothing here can be deformed."}));
  const Outcome run = run_tetwarp(scratch.path(), "deform '" + folder.string() + "' --series 1 -f identity -o out.nii");
  EXPECT_EQ(run.status, 4);
  EXPECT_TRUE(says(run.err, {"512 x 512 x 1 voxels has no cell"}));
}

TEST(HostileInput, NothingThatATerminalWouldObeyReachesIt) {
  const Scratch scratch;
  const std::string name = "in\x1b[31m\x07\xff";
  write_stack(scratch / name, 4, [](int, MadeSlice& slice) {
    slice.series = "1.2\x1b[5m/../..";
    slice.modality = "CT\x1b[7m";
    slice.edit = [](DcmDataset& data) { data.putAndInsertString(DCM_SeriesDescription, "a\x1b[2Jb"); };
  });
  write_file(scratch / name / "junk\nfile", "not an image at all");
  const auto is_clean = [](const Outcome& run) { return (run.out + run.err).find('\x1b') == std::string::npos; };
  const Outcome info = run_tetwarp(scratch.path(), "info in*");
  EXPECT_EQ(info.status, 0);
  EXPECT_TRUE(is_clean(info));
  EXPECT_TRUE(says(info.out, {"in\\x1b[31m\\x07\\xff/junk\\x0afile", "\"a\\x1b[2Jb\"", "UID 1.2\\x1b[5m/../.."}));
  const Outcome deformed = run_tetwarp(scratch.path(), "deform in* -f identity -o out/ --report report.json");
  EXPECT_EQ(deformed.status, 0) << deformed.err;
  EXPECT_TRUE(is_clean(deformed));
  EXPECT_TRUE(json::accept(read_text(scratch / "out.json")));
  EXPECT_TRUE(json::accept(read_text(scratch / "report.json")));
  EXPECT_TRUE(is_clean(run_tetwarp(scratch.path(), "deform in* --series x -f identity -o b.nii")));
  EXPECT_TRUE(is_clean(run_tetwarp(scratch.path(), "info in*/none")));
  EXPECT_TRUE(fs::exists(scratch / "out/IM00001.dcm"));
}

TEST(HostileInput, APipeIsRefusedAndNotWaitedFor) {
  const Scratch scratch;
  for (const char* name : {"pipe", "pipe.nii", "pipe.dcm", "pipe.vtk", "pipe.h5"}) {
    ASSERT_EQ(mkfifo((scratch / name).c_str(), 0600), 0);
    for (const std::string command : {"info ", "deform -f identity -o out.nii "}) {
      const Outcome run = run_tetwarp(scratch.path(), command + name);
      EXPECT_EQ(run.status, 4) << run.err;
      EXPECT_TRUE(says(run.err, {"neither a file nor a folder, ", name}));
    }
  }
}

TEST(InputIsADicomdir, ItsSeriesIsDeformed) {
  TETWARP_REAL_DATA(folder, "head-phantom-multiseries");
  const Scratch scratch;
  const std::string path = "'" + (folder / "S21570/S2010/DIRFILE").string() + "'";
  EXPECT_TRUE(
      says(run_tetwarp(scratch.path(), "info " + path).out,
           {"28 files, 1 of 1 entries can be deformed", "\"STD BRAIN 5MM\":  CT, 512 x 512, 28 slices, 5 mm apart"}));
  EXPECT_EQ(run_tetwarp(scratch.path(), "deform " + path + " -f identity -o out.nii").status, 0);
}

}  // namespace
