// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// A whole derived series, de-identified: what its files hold, read as bytes.
#include <functional>
#include <map>

#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/privacy/dicom_deidentify.h"
#include "io/dicom/scan/dicom_header.h"
#include "tests/io/dicom/derive/derived_source.h"
#include "tests/support/real_data.h"
#include "tests/support/scratch.h"

namespace fs = std::filesystem;

namespace tetwarp::test {
namespace {

using enum ConfidentialityOption;

Deidentification keyed(int key, std::set<ConfidentialityOption> options = {}) {
  return {.key = std::vector<std::byte>(32, static_cast<std::byte>(key)), .options = std::move(options)};
}

/// What lies before Pixel Data, the last attribute, in the files of a folder.
std::string headers_in(const fs::path& folder) {
  std::string bytes;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string file = file_bytes(entry.path());
    bytes += file.substr(0, file.find(std::string("\xe0\x7f\x10\0OW", 6)));
  }
  return bytes;
}

/// A source whose headers have every attribute of the dictionary, each with a text of its own where its VR takes one.
class HostileSource : public testing::Test {
 protected:
  void SetUp() override {
    prepare_dcmtk();
    DcmDataDictionary& dictionary = dcmDataDict.wrlock();  // its iterators want it writable
    std::vector<DcmTag> tags;
    for (auto entry = dictionary.normalBegin(); entry != dictionary.normalEnd(); ++entry) {
      if ((*entry)->getPrivateCreator() == nullptr && (*entry)->getGroup() > 2 && (*entry)->getElement() != 0)
        tags.emplace_back((*entry)->getKey(), (*entry)->getEVR());
    }
    dcmDataDict.wrunlock();
    for (const DcmTag& tag : tags) {
      DcmDataset& slice = source_[0];
      if (!slice.tagExists(tag)) insert_secret(slice, tag);
      if (tag.getEVR() == EVR_SQ && tag.getGroup() <= 0x0040) {
        DcmItem* item = nullptr;
        ASSERT_TRUE(slice.findOrCreateSequenceItem(tag, item).good());
        set(*item, DCM_PatientComments, secret_of(tag));
        set(*item, DcmTag(0x0009, 0x0010), "MAKER");
      }
    }
    for (std::size_t k = 1; k < 3; ++k) {  // alike in all slices, so that nothing is left out as varying
      for (unsigned long n = 0; n < source_[0].card(); ++n) {
        const DcmElement& element = *source_[0].getElement(n);
        if (source_[k].tagExists(element.getTag())) continue;
        ASSERT_TRUE(source_[k].insert(dynamic_cast<DcmElement*>(element.clone())).good());
      }
    }
  }

  static std::string secret_of(const DcmTagKey& tag) {
    char text[20];
    std::snprintf(text, sizeof text, "Q%04X%04X", tag.getGroup(), tag.getElement());
    return text;
  }
  static bool takes_text(DcmEVR vr) {
    switch (vr) {
      case EVR_AE:
      case EVR_CS:
      case EVR_LO:
      case EVR_LT:
      case EVR_PN:
      case EVR_SH:
      case EVR_ST:
      case EVR_UC:
      case EVR_UR:
      case EVR_UT: return true;
      default: return false;
    }
  }
  static void insert_secret(DcmItem& item, const DcmTag& tag) {
    if (takes_text(tag.getEVR())) item.putAndInsertString(tag, secret_of(tag).c_str());
  }

  /// The attributes whose texts are in the files.
  std::vector<DcmTagKey> told(std::set<ConfidentialityOption> options) {
    source_.derivation.form.deidentification = keyed(1, std::move(options));
    const fs::path folder = scratch_ / std::to_string(++folders_);
    source_.write(folder);
    const std::string bytes = headers_in(folder);
    std::vector<DcmTagKey> tags;
    for (unsigned long n = 0; n < source_[0].card(); ++n) {
      const DcmTagKey tag = source_[0].getElement(n)->getTag().getXTag();
      if (bytes.find(secret_of(tag)) != std::string::npos) tags.push_back(tag);
    }
    return tags;
  }

  const Scratch scratch_;
  DerivedSource source_;
  int folders_ = 0;
};

TEST_F(HostileSource, TellsNothingOfWhatTheTableNames) {
  ASSERT_GT(source_[0].card(), 2000U);
  for (const DcmTagKey& tag : told({})) {
    EXPECT_EQ(confidentiality_row(tag), nullptr) << tag_name(tag);
    const DcmEVR vr = DcmTag(tag).getEVR();
    EXPECT_TRUE(vr == EVR_CS || vr == EVR_LO || vr == EVR_SH || vr == EVR_UC || vr == EVR_UR) << tag_name(tag);
    const Uint16 group = tag.getGroup();
    EXPECT_TRUE(vr == EVR_CS || group == 0x0008 || group == 0x0018 || group == 0x0020 || group == 0x0028)
        << tag_name(tag);
  }
}

TEST_F(HostileSource, TellsOnlyWhatItsOptionsRetain) {
  const std::vector<DcmTagKey> basic = told({});
  const auto more = [&](ConfidentialityOption option) {
    std::set<DcmTagKey> tags;
    for (const DcmTagKey& tag : told({option})) {
      if (std::find(basic.begin(), basic.end(), tag) == basic.end()) tags.insert(tag);
    }
    return tags;
  };
  const auto expect = [&](ConfidentialityOption option, const std::vector<DcmTagKey>& some) {
    const std::set<DcmTagKey> tags = more(option);
    for (const DcmTagKey& tag : some) EXPECT_TRUE(tags.contains(tag)) << name_of(option) << tag_name(tag);
    for (const DcmTagKey& tag : tags) {
      const ConfidentialityRow* row = confidentiality_row(tag);
      EXPECT_TRUE(row == nullptr || action_of(*row, {option}, AttributeType::optional) == Confidentiality::keep)
          << name_of(option) << tag_name(tag);
    }
  };
  expect(retain_device, {DCM_DeviceSerialNumber, DCM_StationName, DCM_DeviceID});
  expect(retain_institution, {DCM_InstitutionName, DCM_InstitutionAddress});
  expect(retain_patient, {DCM_SmokingStatus, DCM_EthnicGroup});
  EXPECT_EQ(more(retain_dates), std::set<DcmTagKey>{DCM_TimezoneOffsetFromUTC}) << "the only text";
  EXPECT_TRUE(more(retain_uids).empty());
}

TEST(DeidentifiedSeries, HoldsNothingOfTheSourcesUidsNamesAndDates) {
  const Scratch scratch;
  DerivedSource source;
  source.set_all(DCM_InstitutionName, "HOSPITAL");
  source.set_all(DCM_PatientComments, "said something");
  source.derivation.form.deidentification = keyed(1);
  source.write(scratch / "out");
  const std::string bytes = headers_in(scratch / "out");
  for (const char* secret : {"NAME", "GIVEN", "ID17", "19500101", "REFERRER", "HOSPITAL", "said something", "20200102",
                             "20200103", "20200104", "101112", "S1", "Abdomen 2.5", "1.2.3.1", "1.2.3.2", "1.2.3.3",
                             "1.2.3.4.1", "1.2.3.4.2", "1.2.3.4.3"}) {
    EXPECT_EQ(bytes.find(secret), std::string::npos) << secret;
  }
  Written file(scratch / "out" / "IM00001.dcm");
  EXPECT_EQ(file[DCM_SeriesDescription], "deformed");
  EXPECT_EQ(file[DCM_Manufacturer], "SCANNERS");
  EXPECT_EQ(file[DCM_KVP], "120");
  EXPECT_EQ(file[DCM_StudyDate], "") << "type 2";
  EXPECT_EQ(file[DCM_SeriesDate], "<missing>");
  EXPECT_EQ(file[DCM_PatientIdentityRemoved], "YES");
  EXPECT_TRUE(is_tetwarp_dicom(scratch / "out" / "IM00001.dcm"));
  EXPECT_EQ(load_dicom(scan_dicom(scratch / "out").series.at(0)).volume.voxels, source.volume.voxels);
}

TEST(DeidentifiedSeries, StaysTogetherWithOthersOfItsKey) {
  const Scratch scratch;
  const auto file_of = [&](int key, const std::string& field, const std::string& series) {
    DerivedSource source;
    source.set_all(DCM_SeriesInstanceUID, series);
    source.derivation.field_sha256 = std::string(64, field.front());
    source.derivation.form.deidentification = keyed(key);
    const fs::path folder = scratch / (std::to_string(key) + field + series);
    const DicomWriteReport report = source.write(folder);
    Written file(folder / "IM00001.dcm");
    EXPECT_EQ(file[DCM_SeriesInstanceUID], report.series_uid);
    EXPECT_EQ(file[DCM_FrameOfReferenceUID], report.frame_of_reference_uid);
    return std::map<std::string, std::string>{
        {"study", file[DCM_StudyInstanceUID]},
        {"series", file[DCM_SeriesInstanceUID]},
        {"frame", file[DCM_FrameOfReferenceUID]},
        {"patient", file[DCM_PatientID]},
        {"source", get(item_of(file.data(), DCM_SourceImageSequence), DCM_ReferencedSOPInstanceUID)}};
  };
  auto one = file_of(1, "a", "1.2.3.2"), two = file_of(1, "a", "1.2.3.7"), moved = file_of(1, "b", "1.2.3.2"),
       other = file_of(2, "a", "1.2.3.2");
  for (const char* same : {"study", "frame", "patient", "source"}) EXPECT_EQ(one[same], two[same]) << same;
  EXPECT_NE(one["series"], two["series"]);
  EXPECT_EQ(one["source"], moved["source"]);
  EXPECT_NE(one["frame"], moved["frame"]);
  for (const auto& [name, uid] : one) EXPECT_NE(uid, other[name]) << name;
  EXPECT_EQ(one["source"], Deidentifier(keyed(1), "", "").uid("1.2.3.4.1"));
}

TEST(DeidentifiedSeries, DifferentOptionsAreDifferentSeries) {
  const Scratch scratch;
  std::set<std::string> series;
  for (const ConfidentialityOption option : kConfidentialityOptions) {
    DerivedSource source;
    source.derivation.form.deidentification = keyed(1, {option});
    series.insert(source.write(scratch / name_of(option)).series_uid);
  }
  EXPECT_EQ(series.size(), std::size(kConfidentialityOptions));
}

TEST(DeidentifiedSeries, SaysWhetherTheSourceSaysThatItShowsWho) {
  const Scratch scratch;
  DerivedSource source;
  source.derivation.form.deidentification = keyed(1);
  EXPECT_FALSE(source.write(scratch / "no").says_who);
  set(source[1], DCM_BurnedInAnnotation, "YES");
  EXPECT_TRUE(source.write(scratch / "yes").says_who);
}

/// Every text of two characters or more of a data set, at any depth, by attribute.
void gather(DcmItem& item, std::multimap<std::string, DcmTagKey>& texts) {
  for (unsigned long n = 0; n < item.card(); ++n) {
    DcmElement& element = *item.getElement(n);
    if (auto* sequence = dynamic_cast<DcmSequenceOfItems*>(&element)) {
      for (unsigned long i = 0; i < sequence->card(); ++i) gather(*sequence->getItem(i), texts);
      continue;
    }
    OFString value;
    for (unsigned long i = 0; element.isaString() && i < element.getVM(); ++i) {
      if (element.getOFString(value, i).good() && value.size() > 3)
        texts.emplace(value.c_str(), element.getTag().getXTag());
    }
  }
}

class RealDeidentified : public testing::TestWithParam<const char*> {};

TEST_P(RealDeidentified, HoldsNoTextOfAnAttributeThatTheTableNames) {
  TETWARP_REAL_DATA(folder, GetParam());
  const DicomVolume source = load_dicom(scan_dicom(folder).series.at(0));
  const Scratch scratch;
  fs::create_directory(scratch / "out");
  DicomDerivation derivation{.field_sha256 = std::string(64, 'a'), .parameters = "linear", .description = "Deformed"};
  derivation.form.deidentification = keyed(1);
  write_derived_series(scratch / "out", view(source.volume), *source.headers, derivation);
  const std::string bytes = headers_in(scratch / "out");
  std::multimap<std::string, DcmTagKey> written, texts;
  for (const auto& entry : fs::directory_iterator(scratch / "out")) gather(Written(entry.path()).data(), written);
  for (const auto& slice : source.headers->slices) gather(*slice, texts);
  const auto is_named = [](const DcmTagKey& tag) {
    return confidentiality_row(tag) != nullptr || tag.getGroup() == 0x0010 || tag.getGroup() == 0x0040;
  };
  std::size_t searched = 0;
  for (auto text = texts.begin(); text != texts.end(); text = texts.upper_bound(text->first)) {
    const auto [begin, end] = texts.equal_range(text->first);
    const bool named = std::all_of(begin, end, [&](const auto& use) { return is_named(use.second); });
    if (!named || text->first == "REMOVED") continue;  // or it says something else, too, that is kept
    ++searched;
    EXPECT_FALSE(written.contains(text->first)) << tag_name(text->second) << ": " << text->first;
    if (std::none_of(text->first.begin(), text->first.end(), isalpha)) continue;  // digits are in any number
    EXPECT_EQ(bytes.find(text->first), std::string::npos) << tag_name(text->second) << ": " << text->first;
  }
  EXPECT_GT(searched, 20U);
}

INSTANTIATE_TEST_SUITE_P(Sets, RealDeidentified,
                         testing::Values("chest-cmb-crc", "abdomen-acrin-flt", "head-phantom-multiseries/S21570/S2020",
                                         "overlap-kits-and-topogram/kits-00072"),
                         [](const auto& set) {
                           std::string name = fs::path(set.param).begin()->string();
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace tetwarp::test
