// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Every row of table E.1-1 of PS3.15, under every option, by itself and within a sequence. The table is read anew here,
// and what its letters mean is said anew.
#include <fstream>
#include <sstream>

#include "io/dicom/derive/dicom_file.h"
#include "io/dicom/privacy/dicom_deidentify.h"
#include "tests/io/dicom/derive/derived_source.h"

namespace tetwarp::test {
namespace {

using Options = std::set<ConfidentialityOption>;
using enum ConfidentialityOption;

struct Row {
  std::string tag, name, basic;
  std::vector<std::string> options;  ///< columns 4 to 13 of the table

  DcmTagKey key() const {
    std::string digits = tag == "GGGGEEEE" ? "00091001" : tag;
    for (char& c : digits) c = c == 'X' ? '2' : c;
    return {static_cast<Uint16>(std::stoul(digits.substr(0, 4), nullptr, 16)),
            static_cast<Uint16>(std::stoul(digits.substr(4), nullptr, 16))};
  }
  bool is_kept(const Options& chosen) const {
    const std::pair<ConfidentialityOption, int> columns[] = {
        {retain_uids, 1}, {retain_device, 2}, {retain_institution, 3}, {retain_patient, 4}, {retain_dates, 5}};
    return !is_shifted(chosen) && std::any_of(std::begin(columns), std::end(columns), [&](const auto& column) {
      return chosen.contains(column.first) && options[column.second] == "K";
    });
  }
  bool is_shifted(const Options& chosen) const { return chosen.contains(shift_dates) && options[6] == "C"; }
};

std::vector<Row> rows_of_the_table() {
  std::vector<Row> rows;
  std::ifstream file(TETWARP_CONFIDENTIALITY_TABLE);
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with('#')) continue;
    std::vector<std::string> columns(1);
    for (const char c : line) {
      if (c == '\t')
        columns.emplace_back();
      else
        columns.back() += c;
    }
    EXPECT_EQ(columns.size(), 13U) << line;
    rows.push_back({columns[0], columns[1], columns[2], {columns.begin() + 3, columns.end()}});
  }
  return rows;
}

/// The VR of the dictionary; of attributes that are younger than it, what their names say.
DcmEVR vr_of(const Row& row) {
  const DcmEVR known = DcmTag(row.key()).getEVR();
  if (known == EVR_ox || known == EVR_OverlayData) return EVR_OB;
  if (known == EVR_xs) return EVR_US;
  if (known != EVR_UNKNOWN && known != EVR_UNKNOWN2B && known != EVR_UN) return known;
  const auto ends = [&](const char* text) { return row.name.ends_with(text); };
  return ends("UID") ? EVR_UI : ends("Sequence") ? EVR_SQ : ends("DateTime") ? EVR_DT : ends("Date") ? EVR_DA : EVR_LO;
}

bool is_bytes(DcmEVR vr) { return vr == EVR_OB || vr == EVR_OW || vr == EVR_OF || vr == EVR_OD || vr == EVR_OL; }
bool is_number(DcmEVR vr) {
  return vr == EVR_US || vr == EVR_UL || vr == EVR_SS || vr == EVR_SL || vr == EVR_FL || vr == EVR_FD;
}

constexpr char kSecretUid[] = "1.2.3.987654";
constexpr char kSecret[] = "SECRET";

std::string secret_of(DcmEVR vr) {
  switch (vr) {
    case EVR_UI: return kSecretUid;
    case EVR_DA: return "19870605";
    case EVR_TM: return "040506.5";
    case EVR_DT: return "19870605040506";
    case EVR_AS: return "033Y";
    case EVR_DS:
    case EVR_IS: return "8765432";
    default: return is_number(vr) ? "4321" : is_bytes(vr) ? "BYTES OF SECRETS" : kSecret;
  }
}

void insert_secret(DcmItem& item, const DcmTagKey& key, DcmEVR vr) {
  if (vr == EVR_SQ) {
    DcmItem& within = *new DcmItem;
    auto* sequence = new DcmSequenceOfItems(DcmTag(key, EVR_SQ));
    ASSERT_TRUE(sequence->insert(&within).good());
    ASSERT_TRUE(item.insert(sequence, OFTrue).good());
    set(within, DCM_ReferencedSOPInstanceUID, kSecretUid);
    set(within, DCM_PatientName, kSecret);
    set(within, DCM_CodeValue, "CODE");
    return;
  }
  DcmElement* element = nullptr;
  ASSERT_TRUE(DcmItem::newDicomElementWithVR(element, DcmTag(key, vr)).good());
  const std::string text = secret_of(vr);
  ASSERT_TRUE((is_bytes(vr) ? element->putUint8Array(reinterpret_cast<const Uint8*>(text.data()), text.size())
                            : element->putString(text.c_str()))
                  .good())
      << key.toString();
  ASSERT_TRUE(item.insert(element, OFTrue).good());
}

/// What is there of an attribute: none, nothing, or bytes.
std::optional<std::string> found(DcmItem& item, const DcmTagKey& key) {
  DcmElement* element = nullptr;
  if (item.findAndGetElement(key, element).bad()) return {};
  if (auto* sequence = dynamic_cast<DcmSequenceOfItems*>(element)) {
    std::string text;
    for (unsigned long n = 0; n < sequence->card(); ++n) {
      text += "[" + get(*sequence->getItem(n), DCM_PatientName) + "|" +
              get(*sequence->getItem(n), DCM_ReferencedSOPInstanceUID) + "|" +
              get(*sequence->getItem(n), DCM_CodeValue) + "]";
    }
    return text;
  }
  if (!is_bytes(element->ident())) {
    OFString text;
    return element->getOFStringArray(text).good() ? std::optional<std::string>(text.c_str()) : std::nullopt;
  }
  Uint8* bytes = nullptr;
  if (element->getUint8Array(bytes).good() && bytes)
    return std::string(reinterpret_cast<char*>(bytes), element->getLength());
  return "";
}

bool holds(DcmDataset& dataset, const std::string& text) {
  const std::vector<std::byte> bytes = encoded(dataset);
  return std::search(bytes.begin(), bytes.end(), text.begin(), text.end(),
                     [](std::byte b, char c) { return std::to_integer<char>(b) == c; }) != bytes.end();
}

/// Whether what became of an attribute of unknown type is what the letters of its row say.
testing::AssertionResult is_as_the_row_says(const Row& row, const Options& chosen, DcmEVR vr,
                                            const std::optional<std::string>& after) {
  const auto says = [&](bool holds, const char* what) {
    return holds ? testing::AssertionSuccess()
                 : testing::AssertionFailure() << row.tag << " " << row.name << ": expected " << what << ", found "
                                               << (after ? "\"" + *after + "\"" : "none");
  };
  const bool is_date = vr == EVR_DA || vr == EVR_DT;
  if (vr == EVR_SQ && (row.is_kept(chosen) || row.basic == "X/Z/U*"))
    return says(after && after->find("|CODE]") != std::string::npos && after->find(kSecret) == std::string::npos,
                "items, de-identified");
  if (row.is_kept(chosen) || (row.is_shifted(chosen) && vr == EVR_TM))
    return says(after && *after == secret_of(vr), "the value");
  if (row.is_shifted(chosen) && is_date)
    return says(after && after->size() == secret_of(vr).size() && after->substr(0, 8) < "19870605" &&
                    after->substr(0, 8) > "19770601" && after->substr(8) == secret_of(vr).substr(8),
                "an earlier date");
  if (row.basic == "X") return says(!after, "none");
  if (row.basic == "U") return says(after && after->starts_with("2.25."), "another UID");
  if (row.basic.find('D') == std::string::npos) return says(after && after->empty(), "no value");
  return says(after && !after->empty(), "a dummy");
}

/// Patient's Name and ID, which become one pseudonym.
bool is_pseudonym(const Row& row) { return row.tag == "00100010" || row.tag == "00100020"; }

const Options kChosen[] = {{},
                           {retain_dates},
                           {shift_dates},
                           {retain_device},
                           {retain_institution},
                           {retain_patient},
                           {retain_uids},
                           {retain_dates, retain_device, retain_institution, retain_patient, retain_uids}};

Deidentifier deidentifier(const Options& options, const std::string& patient = "ID17") {
  return {{.key = std::vector<std::byte>(32, std::byte{7}), .options = options}, patient, "1.2.3"};
}

TEST(ConfidentialityTable, IsThatOfTheEditionThatItNames) {
  const std::vector<Row> rows = rows_of_the_table();
  EXPECT_EQ(rows.size(), 657U);
  std::map<std::string, int> counts;
  for (const Row& row : rows) ++counts[row.basic];
  const std::map<std::string, int> expected = {{"X", 417},  {"D", 93},    {"U", 55},  {"Z", 42},    {"X/D", 23},
                                               {"X/Z", 11}, {"X/Z/D", 8}, {"Z/D", 6}, {"X/Z/U*", 2}};
  EXPECT_EQ(counts, expected);
  std::ifstream file(TETWARP_CONFIDENTIALITY_TABLE);
  std::string first;
  std::getline(file, first);
  EXPECT_NE(first.find("PS3.15, edition 2026d"), std::string::npos);
  EXPECT_STREQ(kConfidentialityEdition, "PS3.15 2026d");
}

TEST(ConfidentialityTable, EveryAttributeIsTreatedAsItsRowSays) {
  for (const Row& row : rows_of_the_table()) {
    const DcmEVR vr = vr_of(row);
    for (const Options& options : kChosen) {
      DcmDataset dataset;
      insert_secret(dataset, row.key(), vr);
      deidentifier(options).apply(dataset, false);
      const std::optional<std::string> after = found(dataset, row.key());
      if (!is_pseudonym(row)) {
        EXPECT_TRUE(is_as_the_row_says(row, options, vr, after));
      }
      const bool keeps = row.is_kept(options) || (row.is_shifted(options) && vr == EVR_TM);
      if (is_number(vr)) continue;
      EXPECT_EQ(holds(dataset, secret_of(vr == EVR_SQ ? EVR_PN : vr)), keeps && vr != EVR_SQ) << row.tag << row.name;
    }
  }
}

TEST(ConfidentialityTable, EveryAttributeIsTreatedLikewiseWithinSequences) {
  for (const Row& row : rows_of_the_table()) {
    const DcmEVR vr = vr_of(row);
    for (const Options& options : kChosen) {
      DcmDataset dataset;
      DcmItem* outer = nullptr;
      DcmItem* inner = nullptr;
      ASSERT_TRUE(dataset.findOrCreateSequenceItem(DCM_CTDIPhantomTypeCodeSequence, outer).good());
      ASSERT_TRUE(outer->findOrCreateSequenceItem(DCM_EquivalentCodeSequence, inner).good());
      insert_secret(*inner, row.key(), vr);
      deidentifier(options).apply(dataset, true);
      EXPECT_TRUE(is_as_the_row_says(row, options, vr, found(*inner, row.key())));
    }
  }
}

TEST(ConfidentialityTable, OfSeveralCodesACtImageTakesTheFirstThatItsTypeAllows) {
  EXPECT_EQ(resolved("X/Z/D", AttributeType::optional), Confidentiality::remove);
  EXPECT_EQ(resolved("X/Z/D", AttributeType::may_be_empty), Confidentiality::empty);
  EXPECT_EQ(resolved("X/Z/D", AttributeType::unknown), Confidentiality::dummy);
  EXPECT_EQ(resolved("Z/D", AttributeType::optional), Confidentiality::empty);
  EXPECT_EQ(resolved("X/D", AttributeType::optional), Confidentiality::remove);
  EXPECT_EQ(resolved("X/D", AttributeType::may_be_empty), Confidentiality::dummy);
  EXPECT_EQ(resolved("X/Z", AttributeType::unknown), Confidentiality::empty);
  EXPECT_EQ(resolved("X/Z/U*", AttributeType::optional), Confidentiality::replace_uid);
  EXPECT_EQ(resolved("X", AttributeType::unknown), Confidentiality::remove);
}

}  // namespace
}  // namespace tetwarp::test
