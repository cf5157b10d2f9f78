// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Reads XML files of VTK: .vts .vti .vtr .vtu. VTK's parser reads the XML, and decodes text, base64, raw and compressed
// values into buffers whose size was compared with what the file holds.
#include <vtkCallbackCommand.h>
#include <vtkCommand.h>
#include <vtkLZ4DataCompressor.h>
#include <vtkNew.h>
#include <vtkSmartPointer.h>
#include <vtkXMLDataElement.h>
#include <vtkZLibDataCompressor.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>

#include "deform/errors.h"
#include "deform/geometry.h"
#include "io/meshes/vtk_file.h"
#include "io/meshes/vtk_xml_parser.h"
#include "io/points/points_document.h"

namespace tetwarp {
namespace {

constexpr double kMostPerByte = 1100;  // zlib can inflate a byte to 1032, LZ4 to 255

/// A number type of VTK's files.
struct ValueType {
  int vtk = VTK_FLOAT;
  std::size_t bytes = 4;
  void (*convert)(const std::byte* from, std::span<double> to) = nullptr;
};

template <class Value>
void convert(const std::byte* from, std::span<double> to) {
  for (double& number : to) {
    Value value;
    std::memcpy(&value, from, sizeof value);
    number = static_cast<double>(value);
    from += sizeof value;
  }
}

template <class Value>
ValueType type_as(int vtk) {
  return {vtk, sizeof(Value), convert<Value>};
}

/// The type that a word means; null: text, bits, or no type of VTK.
const ValueType* value_type(const std::string& word) {
  static const std::map<std::string, ValueType> kTypes = {
      {"Float32", type_as<float>(VTK_FLOAT)},          {"Float64", type_as<double>(VTK_DOUBLE)},
      {"Int8", type_as<std::int8_t>(VTK_SIGNED_CHAR)}, {"UInt8", type_as<std::uint8_t>(VTK_UNSIGNED_CHAR)},
      {"Int16", type_as<std::int16_t>(VTK_SHORT)},     {"UInt16", type_as<std::uint16_t>(VTK_UNSIGNED_SHORT)},
      {"Int32", type_as<std::int32_t>(VTK_INT)},       {"UInt32", type_as<std::uint32_t>(VTK_UNSIGNED_INT)},
      {"Int64", type_as<std::int64_t>(VTK_LONG_LONG)}, {"UInt64", type_as<std::uint64_t>(VTK_UNSIGNED_LONG_LONG)}};
  const auto found = kTypes.find(word);
  return found == kTypes.end() ? nullptr : &found->second;
}

/// An attribute of an element without line ends, for messages are one line.
std::string attribute(vtkXMLDataElement* element, const char* key) {
  const char* text = element->GetAttribute(key);
  std::string value = text ? text : "";
  std::replace(value.begin(), value.end(), '\n', ' ');
  return value;
}

/// A message of VTK without its source file, line and address.
std::string plain(const std::string& text) {
  const std::size_t at = text.rfind("): ");
  std::string rest = at == std::string::npos ? text : text.substr(at + 3);
  std::replace(rest.begin(), rest.end(), '\n', ' ');
  while (rest.ends_with(' ')) rest.pop_back();
  return rest;
}

class XmlFile final : public VtkFile {
 public:
  explicit XmlFile(const std::filesystem::path& path)
      : VtkFile(path.string()), bytes_(std::filesystem::file_size(path)), stream_(path, std::ios::binary) {
    require_end();
    vtkNew<vtkCallbackCommand> listener;  // without an observer VTK prints its errors
    listener->SetClientData(this);
    listener->SetCallback([](vtkObject*, unsigned long, void* self, void* text) {
      static_cast<XmlFile*>(self)->complaint_ = plain(text ? static_cast<const char*>(text) : "");
    });
    for (vtkObject* object : {static_cast<vtkObject*>(parser_.Get()), static_cast<vtkObject*>(zlib_.Get()),
                              static_cast<vtkObject*>(lz4_.Get())}) {
      object->AddObserver(vtkCommand::ErrorEvent, listener);
      object->AddObserver(vtkCommand::WarningEvent, listener);
    }
    parser_->SetStream(&stream_);
    const bool parsed = parser_->Parse() != 0;
    require(!parser_->left_out(), "more elements than a dataset has, " + name);
    require(parsed && parser_->GetRootElement(), "no XML that VTK can read, " + name + ": " + complaint_);
    take_root(parser_->GetRootElement());
  }

  ~XmlFile() override {
    for (vtkObject* object : {static_cast<vtkObject*>(parser_.Get()), static_cast<vtkObject*>(zlib_.Get()),
                              static_cast<vtkObject*>(lz4_.Get())})
      object->RemoveAllObservers();
  }

  void read(const VtkArray& array, std::uint64_t first, std::span<double> values) const override {
    const StoredArray& stored = stored_[array.id];
    std::vector<std::byte> raw(values.size() * stored.type->bytes);
    require(read_words(stored, raw.data(), first, values.size()) == values.size(),
            "truncated or damaged values of \"" + array.name + "\", " + name + "; is the file whole?");
    stored.type->convert(raw.data(), values);
  }

 protected:
  void require_holds(const VtkArray& array) const override {
    const StoredArray& stored = stored_[array.id];
    const std::string what = " \"" + array.name + "\", " + name;
    const double length = static_cast<double>(bytes_),
                 count = static_cast<double>(array.tuples) * static_cast<double>(array.components);
    const double needed = count * static_cast<double>(stored.type ? stored.type->bytes : 1);
    require(stored.type != nullptr, "an array of no number type," + what);
    const auto too_much = [&](double held) {
      throw InputError("truncated, or a header that promises too much," + what + ": " + text_of(needed) +
                       " bytes are expected, the file has " + text_of(held));
    };
    if (stored.ascii) {
      if (2 * count - 1 > length) too_much(length);
      std::uint64_t beyond = 0;
      require(read_words(stored, &beyond, array.count(), 1) == 0, "more than " + text_of(count) + " values in" + what);
      return;
    }
    if (needed > length * (compressed() ? kMostPerByte : 1)) too_much(length);
    const double held = compressed() ? require_blocks(stored, what) : plain_length(stored, what);
    if (held != needed) too_much(held);
  }

 private:
  /// Where the values of an array are in the file.
  struct StoredArray {
    vtkXMLDataElement* element = nullptr;
    const ValueType* type = nullptr;
    bool ascii = false;
    vtkTypeInt64 offset = -1;  ///< of appended values; -1: the values are in the element
  };

  bool compressed() const { return parser_->GetCompressor() != nullptr; }

  /// Refuses a file that does not end with </VTKFile>: it was cut off, whatever else it has.
  void require_end() {
    const std::uint64_t length = std::min<std::uint64_t>(bytes_, 256);
    std::string tail(length, '\0');
    stream_.seekg(static_cast<std::streamoff>(bytes_ - length));
    stream_.read(tail.data(), static_cast<std::streamsize>(length));
    tail.resize(tail.find_last_not_of(" \t\r\n") + 1);
    require(tail.ends_with("</VTKFile>"),
            "an XML file that does not end with </VTKFile>, " + name + "; is the file whole?");
    stream_.clear();
    stream_.seekg(0);
  }

  std::size_t read_words(const StoredArray& stored, void* to, std::uint64_t first, std::size_t count) const {
    stream_.clear();
    if (stored.offset >= 0) return parser_->ReadAppendedData(stored.offset, to, first, count, stored.type->vtk);
    return parser_->ReadInlineData(stored.element, stored.ascii ? 1 : 0, to, first, count, stored.type->vtk);
  }

  std::vector<std::uint64_t> head(const StoredArray& stored, std::size_t count, const std::string& what) const {
    stream_.clear();
    std::vector<std::uint64_t> words = parser_->head(stored.element, stored.offset, count);
    require(words.size() == count, "truncated values of" + what + "; is the file whole?");
    return words;
  }

  double plain_length(const StoredArray& stored, const std::string& what) const {
    return static_cast<double>(head(stored, 1, what)[0]);
  }

  /// Checks the table of compressed blocks, which VTK believes when it decompresses them. @return bytes of the values
  double require_blocks(const StoredArray& stored, const std::string& what) const {
    const std::vector<std::uint64_t> first = head(stored, 3, what);
    const std::uint64_t blocks = first[0], block_bytes = first[1], last_bytes = first[2];
    const std::string bad = "damaged blocks of" + what;
    require(blocks > 0 && blocks <= bytes_ / parser_->word_bytes() && block_bytes > 0 && last_bytes < block_bytes, bad);
    const std::vector<std::uint64_t> all = head(stored, 3 + blocks, what);
    double sum = 0;
    for (std::uint64_t n = 3; n < all.size(); ++n) sum += static_cast<double>(all[n]);
    require(sum <= static_cast<double>(bytes_), bad);
    const double whole_blocks = static_cast<double>(last_bytes > 0 ? blocks - 1 : blocks);
    return whole_blocks * static_cast<double>(block_bytes) + static_cast<double>(last_bytes);
  }

  void take_root(vtkXMLDataElement* root) {
    const std::string kind = attribute(root, "type");
    require(attribute(root, "byte_order") == "LittleEndian" || attribute(root, "byte_order") == "BigEndian",
            "the byte_order \"" + attribute(root, "byte_order") + "\", " + name);
    const std::string compressor = attribute(root, "compressor");
    require(compressor.empty() || compressor == "vtkZLibDataCompressor" || compressor == "vtkLZ4DataCompressor",
            "values compressed by " + compressor + ", " + name + "; write them with zlib or LZ4");
    if (compressor == "vtkZLibDataCompressor") parser_->SetCompressor(zlib_.Get());
    if (compressor == "vtkLZ4DataCompressor") parser_->SetCompressor(lz4_.Get());
    format = "VTK " + kind;
    dataset = vtk_dataset_called(kind);
    vtkXMLDataElement* primary = root->FindNestedElementWithName(kind.c_str());
    require(dataset == vtk_dataset(name) && primary,
            "a dataset of the type \"" + kind + "\", " + name + "; expected the one that the suffix stands for");
    require(!primary->GetAttribute("TimeValues"), "several time steps, " + name + "; write one a file");
    std::vector<vtkXMLDataElement*> pieces;
    for (int n = 0; n < primary->GetNumberOfNestedElements(); ++n) {
      vtkXMLDataElement* nested = primary->GetNestedElement(n);
      if (attribute_name(nested) == "Piece") pieces.push_back(nested);
    }
    require(pieces.size() == 1,
            std::to_string(pieces.size()) + " pieces, " + name + "; write the dataset as one piece");
    take_piece(primary, pieces[0]);
  }

  static std::string attribute_name(vtkXMLDataElement* element) { return element->GetName() ? element->GetName() : ""; }

  void take_piece(vtkXMLDataElement* primary, vtkXMLDataElement* piece) {
    std::uint64_t count = 0;
    if (dataset == VtkDataset::unstructured_grid) {
      count = whole(piece, "NumberOfPoints");
      take_cells(piece, whole(piece, "NumberOfCells"));
    } else {
      take_extent(primary, piece);
      count = vtk_point_count(size, name);
    }
    if (dataset == VtkDataset::image) take_place(primary);
    if (dataset == VtkDataset::rectilinear_grid) take_coordinates(piece);
    if (dataset == VtkDataset::structured_grid || dataset == VtkDataset::unstructured_grid) {
      const auto arrays = arrays_of(piece, "Points", count);
      require(arrays.size() == 1 && arrays[0].components == 3, "no Points of 3 components, " + name);
      points = arrays[0];
      require_holds(points);
    }
    field_data = arrays_of(primary, "FieldData", 0);
    for (VtkArray& array : field_data) {
      vtkXMLDataElement* element = stored_[array.id].element;
      if (element->GetAttribute("NumberOfTuples")) array.tuples = whole(element, "NumberOfTuples");
    }
    point_data = arrays_of(piece, "PointData", count);
    for (const VtkArray& array : point_data) {
      if (array.components == 3) require_holds(array);
    }
  }

  void take_extent(vtkXMLDataElement* primary, vtkXMLDataElement* piece) {
    require(attribute(piece, "Extent") == attribute(primary, "WholeExtent"),
            "a part of a grid (Extent=\"" + attribute(piece, "Extent") + "\" of WholeExtent=\"" +
                attribute(primary, "WholeExtent") + "\"), " + name + "; write the dataset as one piece");
    const std::vector<double> extent = numbers(piece, "Extent", 6);
    for (int axis = 0; axis < 3; ++axis) {
      const double low = extent[static_cast<std::size_t>(2 * axis)],
                   high = extent[static_cast<std::size_t>(2 * axis + 1)];
      require(low == std::floor(low) && high == std::floor(high) && std::abs(low) < 1e9 && std::abs(high) < 1e9,
              "Extent=\"" + attribute(piece, "Extent") + "\", " + name + "; expected whole numbers");
      begin[axis] = static_cast<std::int64_t>(low);
      size[axis] = static_cast<std::int64_t>(high) - begin[axis] + 1;
    }
  }

  void take_place(vtkXMLDataElement* primary) {
    const auto triple = [](const std::vector<double>& n, std::size_t at) {
      return glm::dvec3(n[at], n[at + 1], n[at + 2]);
    };
    if (primary->GetAttribute("Origin")) origin = triple(numbers(primary, "Origin", 3), 0);
    if (primary->GetAttribute("Spacing")) spacing = triple(numbers(primary, "Spacing", 3), 0);
    if (!primary->GetAttribute("Direction")) return;
    const std::vector<double> rows = numbers(primary, "Direction", 9);
    direction = glm::transpose(glm::dmat3(triple(rows, 0), triple(rows, 3), triple(rows, 6)));
  }

  void take_coordinates(vtkXMLDataElement* piece) {
    const auto arrays = arrays_of(piece, "Coordinates", 0);
    require(arrays.size() == 3, std::to_string(arrays.size()) + " arrays of coordinates, " + name + "; expected 3");
    for (std::size_t axis = 0; axis < 3; ++axis) {
      coordinates[axis] = arrays[axis];
      coordinates[axis].tuples = static_cast<std::uint64_t>(size[static_cast<int>(axis)]);
      require(arrays[axis].components == 1, "coordinates of other than 1 component, " + name);
      require_holds(coordinates[axis]);
    }
  }

  void take_cells(vtkXMLDataElement* piece, std::uint64_t count) {
    for (const VtkArray& array : arrays_of(piece, "Cells", count)) {
      if (array.name == "types") types_ = array;
      if (array.name == "offsets") offsets_ = array;
      if (array.name == "connectivity") connectivity_ = array;
      require(array.name == "faces" || array.name == "faceoffsets" || array.components == 1,
              "\"" + array.name + "\" of other than 1 component, " + name);
    }
    connectivity_.tuples = 0;
    for (const VtkArray* array : {&types_, &offsets_, &connectivity_})
      require(!array->name.empty(), "no arrays types, offsets and connectivity of cells, " + name);
    require_holds(types_);
    require_holds(offsets_);
  }

  /// The arrays of a part of a piece, each with one tuple for each of `count` items.
  std::vector<VtkArray> arrays_of(vtkXMLDataElement* piece, const char* part, std::uint64_t count) {
    std::vector<VtkArray> arrays;
    vtkXMLDataElement* parent = piece->FindNestedElementWithName(part);
    for (int n = 0; parent && n < parent->GetNumberOfNestedElements(); ++n) {
      vtkXMLDataElement* element = parent->GetNestedElement(n);
      if (attribute_name(element) != "DataArray") continue;
      const StoredArray stored = stored_in(element);
      const std::uint64_t components =
          element->GetAttribute("NumberOfComponents") ? whole(element, "NumberOfComponents") : 1;
      arrays.push_back({attribute(element, "Name"), stored.type ? components : 0, count, stored_.size()});
      stored_.push_back(stored);
    }
    return arrays;
  }

  StoredArray stored_in(vtkXMLDataElement* element) const {
    StoredArray stored{element, value_type(attribute(element, "type"))};
    const std::string form = attribute(element, "format"), what = " of \"" + attribute(element, "Name") + "\", " + name;
    require(form == "ascii" || form == "binary" || form == "appended",
            "the format \"" + form + "\"" + what + "; expected ascii, binary or appended");
    stored.ascii = form == "ascii";
    if (form != "appended") return stored;
    const std::uint64_t offset = whole(element, "offset");
    require(parser_->has_appended() && offset <= bytes_, "no appended values" + what);
    stored.offset = static_cast<vtkTypeInt64>(offset);
    return stored;
  }

  std::uint64_t whole(vtkXMLDataElement* element, const char* key) const {
    return count_of(attribute(element, key), std::string(" (") + key + "), " + name);
  }

  std::vector<double> numbers(vtkXMLDataElement* element, const char* key, std::size_t count) const {
    const std::string text = attribute(element, key), where = std::string(" (") + key + "), " + name;
    const auto words = words_of(text);
    require(words.size() == count,
            std::to_string(words.size()) + " numbers" + where + "; expected " + std::to_string(count));
    std::vector<double> values;
    for (const std::string_view word : words) values.push_back(number_of(word, where));
    return values;
  }

  std::uint64_t bytes_;
  mutable std::ifstream stream_;
  vtkNew<vtkZLibDataCompressor> zlib_;
  vtkNew<vtkLZ4DataCompressor> lz4_;
  vtkNew<VtkXmlParser> parser_;
  std::string complaint_;  ///< the last message of VTK
  std::vector<StoredArray> stored_;
};

}  // namespace

/// Called by vtk_xml_module.cpp, which owns what this returns.
extern "C" VtkFile* tetwarp_open_vtk_xml(const char* path) { return new XmlFile(path); }

}  // namespace tetwarp
