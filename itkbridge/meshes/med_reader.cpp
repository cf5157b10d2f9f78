// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/meshes/med_reader.h"

#include <itk_H5Cpp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "deform/errors.h"
#include "itkbridge/isolated/hdf5_list.h"

namespace tetwarp {
namespace {

constexpr std::size_t kLongestText = 1 << 16, kWord = 16;  // names and units of components have 16 characters each
constexpr std::int64_t kMostComponents = 1000;
constexpr const char* kWholeMesh = "MED_NO_PROFILE_INTERNAL";  // the name of a profile of all nodes

/// A group, and its path for messages.
struct Place {
  H5::Group group;
  std::string path;
};

/// A field of vectors at the nodes, at one step.
struct MedField {
  std::string name, unit;
  Place step;
  std::int64_t number = 0, iteration = 0, components = 0;
  std::array<std::size_t, 3> axes{};  ///< which components are x, y and z
};

/// The text from its first to its last character that is no blank.
std::string trimmed_word(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(' ');
  if (begin == std::string_view::npos) return {};
  return std::string(text.substr(begin, text.find_last_not_of(' ') - begin + 1));
}

/// The word of a component in a text of 16 characters for each.
std::string word(std::string_view text, std::size_t component) {
  return text.size() <= component * kWord ? "" : trimmed_word(text.substr(component * kWord, kWord));
}

/// Which components of a field are a vector: those called DX, DY and DZ, else the only three; empty: it has none.
std::optional<std::array<std::size_t, 3>> axes_of(std::string_view names, std::int64_t components) {
  std::array<std::size_t, 3> axes{};
  std::array<bool, 3> found{};
  for (std::size_t component = 0; component < static_cast<std::size_t>(components); ++component) {
    constexpr std::array<std::string_view, 3> kNames = {"DX", "DY", "DZ"};
    const auto name = std::ranges::find(kNames, word(names, component));
    if (name == kNames.end()) continue;
    const auto axis = static_cast<std::size_t>(name - kNames.begin());
    axes[axis] = component;
    found[axis] = true;
  }
  if (found[0] && found[1] && found[2]) return axes;
  if (components == 3) return std::array<std::size_t, 3>{0, 1, 2};
  return {};
}

bool is_read_unit(const std::string& unit) { return unit == "mm" || unit == "m"; }

/// Reads the layout that the library MED 3 and 4 writes: /ENS_MAA/MESH/STEP/{NOE, MAI} has nodes and cells,
/// /CHA/FIELD/STEP/NOE/PROFILE/CO values at nodes, and /PROFILS/PROFILE/PFL which nodes these are.
class MedReader {
 public:
  explicit MedReader(const std::filesystem::path& path) : source_(path), hdf5_(path.string(), H5F_ACC_RDONLY) {
    root_ = {hdf5_.openGroup("/"), "/"};
    read_version();
    const Place meshes = inside(root_, "ENS_MAA");
    mesh_name_ = only(meshes, "meshes", "write one of them by itself");
    const Place mesh = inside(meshes, mesh_name_);
    require(whole(mesh.group, "TYP") == 0, "a structured mesh" + of(mesh) + "; expected an unstructured one");
    require(whole(mesh.group, "ESP") == 3,
            std::to_string(whole(mesh.group, "ESP")) + " coordinates of a node" + of(mesh) + "; expected 3");
    require(whole(mesh.group, "REP") == 0, "coordinates that are not Cartesian" + of(mesh));
    step_ = inside(mesh, only(mesh, "steps of a mesh", "a mesh that changes is not read"));
    take_fields();
    take_unit(mesh);
  }

  std::vector<ReadRecord> mesh() const {
    const Place nodes = inside(step_, "NOE");
    std::vector<double> coordinates = list(nodes, "COO", Hdf5Numbers::real);
    require(
        static_cast<std::int64_t>(coordinates.size()) == 3 * node_count(),
        std::to_string(coordinates.size()) + " coordinates of " + std::to_string(node_count()) + " nodes" + of(nodes));
    std::vector<ReadRecord> records;
    records.push_back({mesh_name_, {version_[0], version_[1], version_[2]}, std::move(coordinates)});
    records.push_back({unit_, {}, {}});
    if (holds(nodes, "NUM")) records.back().values = list(nodes, "NUM", Hdf5Numbers::whole);
    const Place cells = inside(step_, "MAI");
    for (const std::string& type : names_in(cells)) records.push_back(cells_of(inside(cells, type), type));
    records.front().head.push_back(static_cast<double>(records.size() - 2));
    for (const MedField& field : fields_)
      records.push_back({field.name,
                         {static_cast<double>(field.number), static_cast<double>(field.iteration),
                          static_cast<double>(field.components)},
                         {}});
    return records;
  }

  std::vector<ReadRecord> vectors(std::uint64_t index) const {
    require(index < fields_.size(), "no field number " + std::to_string(index) + ", " + source_.file);
    const MedField& field = fields_[index];
    const Place at_nodes = inside(field.step, "NOE");
    std::vector<ReadRecord> records;
    for (const std::string& name : names_in(at_nodes)) {
      const Place profile = inside(at_nodes, name);
      std::vector<double> nodes;
      if (name != kWholeMesh) nodes = list(inside(inside(root_, "PROFILS"), name), "PFL", Hdf5Numbers::whole);
      const auto count = name == kWholeMesh ? static_cast<std::size_t>(node_count()) : nodes.size();
      const std::vector<double> values = list(profile, "CO", Hdf5Numbers::real);
      require(values.size() == count * static_cast<std::size_t>(field.components),
              std::to_string(values.size()) + " values" + of(profile) + "; expected " +
                  std::to_string(field.components) + " of each of " + std::to_string(count) + " nodes");
      if (count == 0) continue;
      records.push_back({"nodes", {}, std::move(nodes)});
      records.push_back({"vectors", {}, {}});
      for (const std::size_t axis : field.axes) {
        for (std::size_t node = 0; node < count; ++node)
          records.back().values.push_back(in_unit_of_mesh(values[axis * count + node], field));
      }
    }
    return records;
  }

 private:
  /// " in PLACE, FILE", for messages.
  std::string of(const Place& place) const { return " in " + place.path + ", " + source_.file; }

  /// Whether a group holds something of a name. @throws InputError for a link to elsewhere, which HDF5 would follow
  /// into other files
  bool holds(const Place& place, const std::string& name) const {
    require(!name.empty() && name.find('/') == std::string::npos && name != ".",
            "a name that none can have" + of(place));
    const hid_t id = place.group.getId();
    if (::H5Lexists(id, name.c_str(), H5P_DEFAULT) <= 0) return false;
    H5L_info_t info{};
    require(::H5Lget_info(id, name.c_str(), &info, H5P_DEFAULT) >= 0 && info.type == H5L_TYPE_HARD,
            name + " is a link" + of(place) + "; expected the thing itself");
    return true;
  }
  Place inside(const Place& place, const std::string& name) const {
    require(holds(place, name), "no " + name + of(place) + "; expected the layout of MED");
    return {place.group.openGroup(name), (place.path == "/" ? "/" : place.path + "/") + name};
  }
  static std::vector<std::string> names_in(const Place& place) {
    std::vector<std::string> names;
    for (hsize_t n = 0; n < place.group.getNumObjs(); ++n) names.push_back(place.group.getObjnameByIdx(n));
    return names;
  }
  /// The name of the only thing in a group. @param what  and `advice` are for the message where there are several
  std::string only(const Place& place, const std::string& what, const std::string& advice) const {
    const std::vector<std::string> names = names_in(place);
    std::string all;
    for (std::size_t n = 0; n < names.size() && n < 10; ++n) all += (n == 0 ? "\"" : ", \"") + names[n] + "\"";
    require(!names.empty(), "nothing" + of(place) + "; expected one of the " + what);
    require(names.size() == 1,
            std::to_string(names.size()) + " " + what + " (" + all + ")" + of(place) + "; " + advice);
    return names.front();
  }

  std::vector<double> list(const Place& place, const std::string& name, Hdf5Numbers numbers) const {
    require(holds(place, name), "no " + name + of(place) + "; expected the layout of MED");
    const H5::DataSet set = place.group.openDataSet(name);
    const H5::DSetCreatPropList layout = set.getCreatePlist();
    require(
        layout.getLayout() <= H5D_CHUNKED && (layout.getLayout() != H5D_CONTIGUOUS || layout.getExternalCount() == 0),
        name + " has its values in another file" + of(place));
    return hdf5_list(set, numbers, place.path + "/" + name, source_);
  }

  /// A whole number beside an object. @throws InputError where there is none
  std::int64_t whole(const H5::H5Object& object, const char* name) const {
    require(object.attrExists(name),
            std::string("no attribute ") + name + ", " + source_.file + "; expected that of MED");
    const H5::Attribute attribute = object.openAttribute(name);
    require(attribute.getTypeClass() == H5T_INTEGER && attribute.getSpace().getSimpleExtentNpoints() == 1,
            std::string("the attribute ") + name + " is not one whole number, " + source_.file);
    std::int64_t value = 0;
    attribute.read(H5::PredType::NATIVE_INT64, &value);
    return value;
  }
  /// A text beside an object; empty: there is none.
  std::string text(const H5::H5Object& object, const char* name) const {
    if (!object.attrExists(name)) return {};
    const H5::Attribute attribute = object.openAttribute(name);
    if (attribute.getSpace().getSimpleExtentNpoints() == 0) return {};
    require(attribute.getTypeClass() == H5T_STRING && attribute.getSpace().getSimpleExtentNpoints() == 1 &&
                !attribute.getStrType().isVariableStr() && attribute.getStrType().getSize() <= kLongestText,
            std::string("the attribute ") + name + " is not one short text, " + source_.file);
    std::string value;
    attribute.read(attribute.getStrType(), value);
    return value.substr(0, value.find('\0'));
  }

  void read_version() {
    require(holds(root_, "INFOS_GENERALES"), "no MED file, " + source_.file + "; expected INFOS_GENERALES in it");
    const Place infos = inside(root_, "INFOS_GENERALES");
    std::string all;
    for (std::size_t n = 0; n < version_.size(); ++n) {
      constexpr std::array kNames = {"MAJ", "MIN", "REL"};
      version_[n] = static_cast<double>(whole(infos.group, kNames[n]));
      all += (n == 0 ? "" : ".") + std::to_string(whole(infos.group, kNames[n]));
    }
    require(version_[0] == 3 || version_[0] == 4,
            "MED " + all + ", " + source_.file + "; expected MED 3 or 4, to which medimport brings older files");
  }

  std::int64_t node_count() const {
    const Place nodes = inside(step_, "NOE");
    require(holds(nodes, "COO"), "no COO" + of(nodes) + "; expected coordinates");
    const std::int64_t count = whole(nodes.group.openDataSet("COO"), "NBR");
    constexpr std::int64_t kMost = std::int64_t{1} << 40;
    require(count >= 0 && count < kMost, std::to_string(count) + " nodes" + of(nodes));
    return count;
  }

  ReadRecord cells_of(const Place& cells, const std::string& type) const {
    if (holds(cells, "INN"))  // polygons and polyhedra: where each of them begins, and where the last ends
      return {type, {static_cast<double>(list(cells, "INN", Hdf5Numbers::whole).size()) - 1}, {}};
    std::vector<double> nodes = list(cells, "NOD", Hdf5Numbers::whole);
    return {type, {static_cast<double>(whole(cells.group.openDataSet("NOD"), "NBR"))}, std::move(nodes)};
  }

  /// Finds the fields of this mesh that have a vector at nodes: float or double, and so many components.
  void take_fields() {
    if (!holds(root_, "CHA")) return;
    const Place fields = inside(root_, "CHA");
    for (const std::string& name : names_in(fields)) {
      const Place field = inside(fields, name);
      constexpr std::int64_t kFloat64 = 6, kFloat32 = 4;
      const std::int64_t type = whole(field.group, "TYP"), components = whole(field.group, "NCO");
      const std::string mesh = trimmed_word(text(field.group, "MAI"));
      if ((type != kFloat64 && type != kFloat32) || components > kMostComponents || mesh != mesh_name_) continue;
      const auto axes = axes_of(text(field.group, "NOM"), components);
      if (!axes) continue;
      const std::string units = text(field.group, "UNI"), unit = word(units, (*axes)[0]);
      const bool same = word(units, (*axes)[1]) == unit && word(units, (*axes)[2]) == unit;
      for (const std::string& step_name : names_in(field)) {
        const Place step = inside(field, step_name);
        if (!holds(step, "NOE")) continue;
        fields_.push_back({name, same && is_read_unit(unit) ? unit : "", step, whole(step.group, "NDT"),
                           whole(step.group, "NOR"), components, *axes});
      }
    }
  }

  /// Finds the unit: that of the coordinates, else that of the displacements, where either says mm or m.
  /// @throws InputError for another unit of length
  void take_unit(const Place& mesh) {
    const std::string units = text(mesh.group, "UNI"), unit = word(units, 0);
    require(word(units, 1) == unit && word(units, 2) == unit, "several units of coordinates" + of(mesh));
    const std::set<std::string> others = {"cm", "dm", "km", "um", "nm", "inch", "in", "ft"};
    require(!others.contains(unit), "coordinates in " + unit + of(mesh) + "; expected mm or m");
    if (is_read_unit(unit)) {
      unit_ = unit;
      return;
    }
    std::set<std::string> stated;
    for (const MedField& field : fields_) {
      if (!field.unit.empty()) stated.insert(field.unit);
    }
    require(stated.size() < 2, "fields in mm and in m, and coordinates in neither" + of(mesh));
    if (!stated.empty()) unit_ = *stated.begin();
  }

  double in_unit_of_mesh(double value, const MedField& field) const {
    if (field.unit.empty() || field.unit == unit_) return value;
    return field.unit == "m" ? value * 1000 : value / 1000;
  }

  Hdf5Source source_;
  H5::H5File hdf5_;
  Place root_, step_;  ///< of the file; of the mesh
  std::array<double, 3> version_{};
  std::string mesh_name_, unit_;
  std::vector<MedField> fields_;
};

}  // namespace

std::vector<ReadRecord> read_med_unconfined(const std::filesystem::path& path, std::uint64_t part) {
  try {
    H5::Exception::dontPrint();
    const MedReader reader(path);
    return part == 0 ? reader.mesh() : reader.vectors(part - 1);
  } catch (const H5::Exception& error) {
    throw InputError("HDF5 cannot read " + path.string() + ": " + error.getDetailMsg() +
                     "; the file may be truncated or damaged");
  }
}

}  // namespace tetwarp
