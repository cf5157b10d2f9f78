// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Nothing that a de-identified run writes holds a word of the paths, the rows and the files that it reads: every byte
// of every file is searched, also within gzip, whatever succeeds, is left out, refused or fails.
#include "io/lower_case.h"
#include "tests/apps/batch/batch_case.h"

namespace {

using namespace tetwarp::test;
using nlohmann::json;
namespace fs = std::filesystem;
using tetwarp::lower;

constexpr const char* kSecret = "mustermann";

class DeidentifiedBatch : public BatchCase {
 protected:
  void SetUp() override {
    BatchCase::SetUp();
    const fs::path in = scratch_ / "Mustermann_Erika";
    fs::rename(scratch_ / "series", in);
    std::vector<fs::path> slices;
    for (const auto& entry : fs::directory_iterator(in)) slices.push_back(entry.path());
    for (const fs::path& slice : slices) fs::rename(slice, in / ("Mustermann_" + slice.filename().string()));
    fs::copy_file(in / ("Mustermann_" + slices.front().filename().string()), in / "Mustermann_copy.dcm");
    fs::rename(scratch_ / "ct.nii.gz", in.string() + ".nii.gz");
    ASSERT_EQ(run("field translate:by=1/0/0 --like Mustermann_Erika.nii.gz -o Mustermann_field.mha --quiet").status, 0);
    ASSERT_EQ(run("invert translate:by=1/0/0 --like Mustermann_Erika.nii.gz -o Mustermann_pull.mha --quiet").status, 0);
    silence_direction("Mustermann_field.mha");
    silence_direction("Mustermann_pull.mha");
    write_file(scratch_ / "Mustermann_key", "a secret of more than sixteen bytes");
    write_file(scratch_ / "Mustermann.csv", "x,y,z\n0,0,0\n9000,0,0\n");
    write_file(scratch_ / "Mustermann_bad.csv", "x,y,z\nMustermann,0,0\n");
    write_file(scratch_ / "Mustermann.tfm",
               "#Insight Transform File V1.0\n#Transform 0\nTransform: TranslationTransform_double_3_3\n"
               "Parameters: 1 0 0\nFixedParameters:\n");
    write_file(scratch_ / "Mustermann_scenario.json", R"({"Mustermann": 1})");
    write_file(scratch_ / "Mustermann_cut.nii.gz", read_text(scratch_ / "Mustermann_Erika.nii.gz").substr(0, 4000));
    fs::create_directory(scratch_ / "Mustermann_empty");
    write_file(scratch_ / "Mustermann_empty/Mustermann.dcm", "no DICOM, Mustermann");
    fs::copy(in, scratch_ / "Mustermann_broken");
    for (const auto& entry : fs::directory_iterator(scratch_ / "Mustermann_broken"))
      fs::resize_file(entry.path(), fs::file_size(entry.path()) - 700);
  }

  /// Fields of other programs do not say which way they map, and notes name such a file.
  void silence_direction(const std::string& name) const {
    std::string bytes = read_text(scratch_ / name);
    const auto at = bytes.find("tetwarp_direction");
    ASSERT_NE(at, std::string::npos);
    bytes.replace(at, 7, "unknown");
    write_file(scratch_ / name, bytes);
  }

  /// `tetwarp batch` of one row: a case of Mustermann_Erika with these keys.
  std::string row(const std::string& id, const std::string& keys, const std::string& input = "Mustermann_Erika") const {
    return R"({"case": ")" + id + R"(", "input": ")" + input +
           R"(", "output": "dicom", "deidentify": "basic", "deidentify-key": "Mustermann_key", )" + keys + "}\n";
  }

  /// Files below a folder that hold the secret, as they are or within gzip, but for the texts that are allowed.
  std::vector<std::string> found_in(const std::string& folder, const std::string& allowed = "\n\n") const {
    std::vector<std::string> found;
    for (const auto& entry : fs::recursive_directory_iterator(scratch_ / folder)) {
      if (!entry.is_regular_file()) continue;
      std::string bytes = read_text(entry.path());
      if (entry.path().extension() == ".gz")
        bytes = run_program(scratch_.path(), "gzip", "-dc '" + entry.path().string() + "'").out;
      bytes = lower(bytes);
      for (auto at = bytes.find(allowed); at != std::string::npos; at = bytes.find(allowed, at))
        bytes.erase(at, allowed.size());
      if (bytes.find(kSecret) != std::string::npos) found.push_back(entry.path().string());
    }
    return found;
  }
};

TEST_F(DeidentifiedBatch, WritesNoWordOfPathsRowsAndFiles) {
  const std::string all =
      R"("report": "report.json", "preview": "look.png", "coverage": "c.nii.gz", "outside": "rest", )";
  const Outcome made = batch(
      row("field", all + R"("field": ["Mustermann_field.mha", "wave:amplitude=1,wavelength=90"], "inverse": "i.dcm", )"
                         R"("write-field": "f.nii.gz", "jacobian": "j.nrrd", "folds": "n.mha", )"
                         R"("points": ["Mustermann.csv=p.csv"], "comment": "Mustermann", )"
                         R"("with": ["Mustermann_Erika.nii.gz=w.nii.gz:nearest:own"])") +
          row("pull", all + R"("pull-field": "Mustermann_pull.mha")") +
          row("transform", all + R"("field": "Mustermann.tfm", "cell-size": 8)") +
          row("covers-not", R"("field": "Mustermann_field.mha")") +
          row("bad-points", R"("field": "identity", "points": ["Mustermann_bad.csv=p.csv"])") +
          row("cut", R"("field": "identity", "with": ["Mustermann_cut.nii.gz=w.nii.gz"])") +
          row("no-dicom", R"("field": "identity")", "Mustermann_empty") +
          row("broken", R"("field": "identity")", "Mustermann_broken"),
      "-o out");
  EXPECT_EQ(made.status, 3) << made.err;
  const auto lines = lines_of("out/results.jsonl");
  for (const char* id : {"field", "pull", "transform"}) EXPECT_EQ(lines.at(id)["status"], "done") << made.err;
  for (const char* id : {"bad-points", "cut", "no-dicom", "broken"}) {
    EXPECT_NE(lines.at(id)["status"], "done") << id;
    EXPECT_TRUE(says(lines.at(id)["reason"], {"standard error"})) << id;
    EXPECT_TRUE(says(made.err, {"case " + std::string(id)}));
  }
  EXPECT_TRUE(says(made.err, {"Mustermann_bad.csv", "Mustermann_empty"})) << "who starts a batch is told the reason";
  EXPECT_EQ(found_in("out"), std::vector<std::string>());
}

TEST_F(DeidentifiedBatch, TellsWhyACaseCameToNothingEvenWhereItIsToBeQuiet) {
  const Outcome made =
      batch(row("a", R"("field": "identity", "points": ["Mustermann_bad.csv=p.csv"])"), "-o out --quiet");
  EXPECT_EQ(made.status, 3);
  EXPECT_TRUE(says(made.err, {"case a refused", "Mustermann_bad.csv"}));
  EXPECT_EQ(found_in("out"), std::vector<std::string>());
}

TEST_F(DeidentifiedBatch, NamesACaseAsItsFolderAndNothingElse) {
  ASSERT_EQ(batch(row("Mustermann-1", R"("field": "identity", "report": "report.json")"), "-o out --quiet").status, 0);
  EXPECT_EQ(found_in("out", "mustermann-1"), std::vector<std::string>());
  EXPECT_EQ(read_text(scratch_ / "out/Mustermann-1/dicom.json").find("Mustermann"), std::string::npos);
}

TEST_F(DeidentifiedBatch, KeepsWhatTheCaseCannotBeReadWithout) {
  ASSERT_EQ(
      batch(row("a", R"("field": ["Mustermann_field.mha", "twist:angle=3"], "outside": "rest")"), "-o out --quiet")
          .status,
      0);
  const json sidecar = json::parse(read_text(scratch_ / "out/a/dicom.json"));
  EXPECT_EQ(sidecar["options"]["field"], json({"left out", "twist:angle=3"}));
  EXPECT_EQ(sidecar["options"]["outside"], "rest");
  EXPECT_EQ(sidecar["field"]["direction"], "forward");
  EXPECT_EQ(sidecar["output"]["voxel_type"], "int16");
  for (const char* key : {"version", "commit", "backend"}) EXPECT_TRUE(sidecar.contains(key)) << key;
  EXPECT_EQ(run("batch m.jsonl -o out --resume --quiet").status, 0);
  EXPECT_EQ(lines_of("out/results.jsonl").at("a")["outputs"][0]["path"], "a/dicom.json");
}

TEST_F(DeidentifiedBatch, ThePreviewOfAFieldIsTheSameWhateverItsFileIsCalled) {
  fs::copy_file(scratch_ / "Mustermann_field.mha", scratch_ / "other.mha");
  const auto preview = [&](const std::string& field, const std::string& more) {
    const Outcome made = run("deform Mustermann_Erika -f " + field +
                             " --outside rest -o out --overwrite --backend cpu --preview p.png" + more);
    EXPECT_EQ(made.status, 0) << made.err;
    return read_text(scratch_ / "p.png");
  };
  const std::string hidden = " --deidentify basic --deidentify-key Mustermann_key";
  EXPECT_EQ(preview("Mustermann_field.mha", hidden), preview("other.mha", hidden));
  EXPECT_NE(preview("Mustermann_field.mha", ""), preview("other.mha", "")) << "its title has the name else";
}

TEST_F(DeidentifiedBatch, OfOneRunTheSidecarAndTheReportNameNothingEither) {
  const Outcome made =
      run("deform Mustermann_Erika -f Mustermann_field.mha --outside rest -o Mustermann_out --deidentify basic "
          "--deidentify-key Mustermann_key --report Mustermann_report.json --write-field Mustermann_f.nrrd --points "
          "Mustermann.csv=Mustermann_p.csv --coverage Mustermann_c.nii");
  ASSERT_EQ(made.status, 0) << made.err;
  for (const char* name : {"Mustermann_out.json", "Mustermann_report.json", "Mustermann_f.nrrd", "Mustermann_p.csv"})
    EXPECT_EQ(lower(read_text(scratch_ / name)).find(kSecret), std::string::npos) << name;
  EXPECT_EQ(found_in("Mustermann_out"), std::vector<std::string>());
}

}  // namespace
