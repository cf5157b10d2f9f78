// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// MED files. tests/support/make_med.py wrote them, by the library MED. HDF5 makes damaged ones of them.
#include <gtest/gtest.h>
#include <itk_H5Cpp.h>

#include <chrono>
#include <functional>
#include <glm/geometric.hpp>
#include <random>

#include "io/mesh_file.h"
#include "tests/support/image_samples.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

const std::string kLinear = TETWARP_MED_FILES "/linear.med", kQuadratic = TETWARP_MED_FILES "/quadratic.med",
                  kSmall = TETWARP_FUZZ_CORPUS "/mesh-med/small.med";
const std::string kMesh = "/ENS_MAA/liver", kStep = kMesh + "/-0000000000000000001-0000000000000000001",
                  kDepl = "/CHA/RESU____DEPL", kThird = kDepl + "/0000000000000000000300000000000000000003/NOE",
                  kValues = kThird + "/MED_NO_PROFILE_INTERNAL";

MeshFile read(const std::string& text) { return read_mesh_file(parse_field_source(text)); }

std::string refused(const std::string& text) {
  return refusal([&] { read(text); });
}

std::string all_of(const std::vector<std::string>& notes) {
  std::string all;
  for (const std::string& note : notes) all += note + "\n";
  return all;
}

/// (z, x, y) of a point: the displacements that make_med.py writes.
glm::dvec3 turned(const glm::dvec3& point) { return {point.z, point.x, point.y}; }

double volume(const TetrahedralMesh& mesh, std::size_t t) {
  const glm::u32vec4& v = mesh.tetrahedra[t];
  const glm::dvec3 a = mesh.rest[v[0]];
  return glm::dot(mesh.rest[v[1]] - a, glm::cross(mesh.rest[v[2]] - a, mesh.rest[v[3]] - a)) / 6;
}

/// The volumes of the cells, which follow one another in the order of their shapes. Each tetrahedron must have a
/// positive one.
std::vector<double> volumes(const MeshFile& file) {
  std::vector<double> all;
  std::size_t t = 0;
  for (const auto& [shape, parts] : {std::pair{CellShape::tetrahedron, 1},
                                     {CellShape::pyramid, 2},
                                     {CellShape::wedge, 3},
                                     {CellShape::hexahedron, 6}}) {
    for (std::uint64_t cell = 0; cell < file.header.cells[static_cast<std::size_t>(shape)]; ++cell) {
      all.push_back(0);
      for (int part = 0; part < parts; ++part, ++t) {
        EXPECT_GT(volume(file.mesh, t), 0) << to_string(shape);
        all.back() += volume(file.mesh, t);
      }
    }
  }
  EXPECT_EQ(t, file.mesh.tetrahedra.size());
  return all;
}

void expect_near(const std::vector<double>& values, const std::vector<double>& expected) {
  ASSERT_EQ(values.size(), expected.size());
  for (std::size_t n = 0; n < values.size(); ++n) EXPECT_NEAR(values[n], expected[n], 1e-12) << n;
}

/// Expects displacements that are a factor times (z, x, y).
void expect_turned(const MeshFile& file, double factor) {
  ASSERT_FALSE(file.mesh.rest.empty());
  for (std::size_t v = 0; v < file.mesh.rest.size(); ++v)
    EXPECT_EQ(glm::dvec3(file.mesh.displacement[v]), factor * turned(file.mesh.rest[v])) << v;
}

TEST(Med, CellsHaveTheVolumesThatMedcouplingFinds) {
  const MeshFile file = read(kLinear + ":displacement=RESU____DEPL,step=3");
  EXPECT_EQ(file.header.format, "MED 4.2.0, mesh liver");
  EXPECT_EQ(file.header.units, "mm");
  EXPECT_EQ(file.header.units_basis, FieldBasis::stated);
  EXPECT_EQ(file.header.frame_basis, FieldBasis::assumed);
  EXPECT_EQ(file.mesh.rest.size(), 46U);
  EXPECT_TRUE(says(all_of(file.header.notes),
                   {"1 elements of the type TR3 are left out", "1 vertices are corners of no cell"}));
  expect_near(volumes(file), {1.0 / 6, 8.0 / 6, 1.0 / 3, 8.0 / 3, 0.5, 4, 1, 8});
}

TEST(Med, DisplacementOfAStepIsRead) {
  const MeshFile file = read(kLinear + ":displacement=RESU____DEPL,step=3");
  EXPECT_EQ(file.header.displacement, "RESU____DEPL, step 3");
  EXPECT_EQ(file.header.arrays, (std::vector<std::string>{"BEAM", "FULL", "PART", "RESU____DEPL, step 1",
                                                          "RESU____DEPL, step 3", "RESU____VITE"}))
      << "and no RESU____SIGM, which has no DX";
  expect_turned(file, 0.25);
  expect_turned(read(kLinear + ":displacement=RESU____DEPL,step=1"), 0);
  expect_turned(read(kLinear + ":step=3"), 0.25);  // DEPL is a usual name
  EXPECT_TRUE(says(refused(kLinear + ":step=2"), {"no step 2", "RESU____DEPL, step 3"}));
  EXPECT_TRUE(says(refused(kLinear), {"which vectors", "RESU____DEPL, step 3"}));
}

TEST(Med, FieldsOfCodeAsterHaveShortNames) {
  EXPECT_EQ(read(kLinear + ":displacement=DEPL,step=3").header.displacement, "RESU____DEPL, step 3");
  EXPECT_TRUE(says(refused(kLinear + ":displacement=SIGM"), {"no vectors called \"SIGM\"", "RESU____VITE"}));
  EXPECT_TRUE(says(refused(kLinear + ":displacement=RESU"), {"no vectors called \"RESU\""}));
}

TEST(Med, ComponentsAreFoundByTheirNames) {
  const MeshFile file = read(kLinear + ":displacement=VITE");  // DZ, DX, DY
  for (const glm::vec3& by : file.mesh.displacement) EXPECT_EQ(by, glm::vec3(1, 2, 3));
  const MeshFile beam = read(kLinear + ":displacement=BEAM");
  expect_turned(beam, 1);
  EXPECT_TRUE(says(all_of(beam.header.notes), {"of the 6 components of \"BEAM\" DX, DY and DZ are taken"}));
}

TEST(Med, ProfileGivesVectorsToItsNodesAlone) {
  const MeshFile full = read(kLinear + ":displacement=FULL");  // m, the coordinates mm; the last iteration
  expect_turned(full, 1000.0 / 1024);
  EXPECT_TRUE(says(all_of(full.header.notes), {"of the iterations of a step of \"FULL\" the last is taken"}));
  EXPECT_TRUE(says(refused(kLinear + ":displacement=PART"), {"a displacement that is missing", "at vertex 3,"}));
  const MeshFile small = read(kSmall);  // the nodes of its profile go backwards, its vectors are 0, 1, 2, ...
  const std::vector<glm::vec3> expected = {{9, 10, 11}, {6, 7, 8}, {3, 4, 5}, {0, 1, 2}};
  EXPECT_EQ(small.mesh.displacement, expected);
}

TEST(Med, QuadraticCellsAreTakenByTheirCorners) {
  const MeshFile file = read(kQuadratic);
  EXPECT_EQ(file.header.format, "MED 3.0.0, mesh quadratic");
  EXPECT_EQ(file.header.units_basis, FieldBasis::assumed);
  EXPECT_EQ(file.mesh.rest.size(), 4U + 5 + 6 + 8);
  EXPECT_TRUE(says(all_of(file.header.notes), {"4 quadratic cells are made linear"}));
  expect_near(volumes(file), {1.0 / 6, 1.0 / 3, 0.5, 1});
  expect_turned(file, 1);  // float
  const MeshFile metres = read(kQuadratic + ":units=m,frame=ras");
  EXPECT_EQ(metres.mesh.rest[1], glm::dvec3(-1000, -1000, 1000) * file.mesh.rest[1]);
}

TEST(Med, NodesHaveTheNumbersOfTheFile) {
  const Scratch scratch;
  std::string table;
  for (int n = 1; n <= 10 + 13 + 15 + 20; ++n) table += std::to_string(10 * n) + " " + std::to_string(n) + " 0 0\n";
  write_file(scratch / "table.txt", table);
  const MeshFile file = read(kQuadratic + ":table=" + (scratch / "table.txt").string());
  EXPECT_EQ(file.mesh.displacement[4], glm::vec3(11, 0, 0)) << "the first corner behind a tetrahedron of 10 nodes";
  write_file(scratch / "table.txt", "11 0 0 0\n");
  EXPECT_TRUE(says(refused(kQuadratic + ":table=" + (scratch / "table.txt").string()), {"the node 11"}));
}

// -- what HDF5 makes of a file

using Change = std::function<void(H5::H5File&)>;

/// A file, changed. @return the path of the copy
std::string changed(const Scratch& scratch, const std::string& path, const Change& change) {
  const std::filesystem::path copy = scratch / "a.med";
  std::filesystem::copy_file(path, copy, std::filesystem::copy_options::overwrite_existing);
  std::filesystem::permissions(copy, std::filesystem::perms::owner_write, std::filesystem::perm_options::add);
  H5::H5File file(copy.string(), H5F_ACC_RDWR);
  change(file);
  return copy.string();
}

Change without(const std::string& name) {
  return [=](H5::H5File& file) { file.unlink(name); };
}
Change renamed(const std::string& name, const std::string& other) {
  return [=](H5::H5File& file) { file.move(name, other); };
}
Change copied(const std::string& name, const std::string& other) {
  return [=](H5::H5File& file) {
    ASSERT_GE(::H5Ocopy(file.getId(), name.c_str(), file.getId(), other.c_str(), H5P_DEFAULT, H5P_DEFAULT), 0);
  };
}
Change with_number(const std::string& object, const std::string& attribute, std::int64_t value) {
  return [=](H5::H5File& file) {
    const H5::DataSpace one;
    ASSERT_GE(::H5Adelete_by_name(file.getId(), object.c_str(), attribute.c_str(), H5P_DEFAULT), 0);
    const hid_t id = ::H5Acreate_by_name(file.getId(), object.c_str(), attribute.c_str(), H5T_NATIVE_INT64, one.getId(),
                                         H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(::H5Awrite(id, H5T_NATIVE_INT64, &value), 0);
    ::H5Aclose(id);
  };
}
/// Gives the coordinates a unit, or the components of a field.
Change with_unit(const std::string& object, const std::vector<std::string>& units) {
  return [=](H5::H5File& file) {
    std::string all;
    for (const std::string& unit : units) all += unit + std::string(16 - unit.size(), ' ');
    H5::Group group = file.openGroup(object);
    group.removeAttr("UNI");
    const H5::StrType type(H5::PredType::C_S1, all.size() + 1);
    group.createAttribute("UNI", type, H5::DataSpace()).write(type, all);
  };
}
template <class Number>
Change with_values(const std::string& name, const std::vector<Number>& values) {
  return [=](H5::H5File& file) {
    constexpr bool kReal = std::is_floating_point_v<Number>;
    file.openDataSet(name).write(values.data(), kReal ? H5::PredType::NATIVE_DOUBLE : H5::PredType::NATIVE_INT64);
  };
}
/// Puts a list of so many numbers, which are not written, in the place of another one.
Change with_length(const std::string& name, hsize_t length) {
  return [=](H5::H5File& file) {
    file.unlink(name);
    H5::DataSet set = file.createDataSet(name, H5::PredType::IEEE_F64LE, H5::DataSpace(1, &length));
    if (length < 1000) set.write(std::vector<double>(length).data(), H5::PredType::NATIVE_DOUBLE);
    const std::int64_t nodes = static_cast<std::int64_t>(length) / 3;
    set.createAttribute("NBR", H5::PredType::NATIVE_INT64, H5::DataSpace()).write(H5::PredType::NATIVE_INT64, &nodes);
  };
}

struct Case {
  Change change;
  std::vector<std::string> words;
};

void expect_refused(const std::string& path, const std::string& options, const std::vector<Case>& cases) {
  const Scratch scratch;
  for (const Case& each : cases) {
    const std::string why = refused(changed(scratch, path, each.change) + options);
    std::vector<std::string> words = each.words;
    words.insert(words.end(), {"InputError", "a.med"});
    EXPECT_TRUE(says(why, words));
    EXPECT_EQ(why.find('\n'), std::string::npos) << why;
  }
}

TEST(Med, FilesOfOtherLayoutsAreRefused) {
  const std::string mesh = kStep + "/MAI";
  expect_refused(kLinear, ":displacement=DEPL,step=3",
                 {{without("/INFOS_GENERALES"), {"no MED file", "INFOS_GENERALES"}},
                  {with_number("/INFOS_GENERALES", "MAJ", 2), {"MED 2.2.0", "medimport"}},
                  {with_number("/INFOS_GENERALES", "MAJ", 5), {"MED 5.2.0"}},
                  {without("/ENS_MAA"), {"no ENS_MAA in /"}},
                  {without(kMesh), {"nothing in /ENS_MAA"}},
                  {copied(kMesh, "/ENS_MAA/other"), {"2 meshes (\"liver\", \"other\")", "one of them by itself"}},
                  {copied(kStep, kMesh + "/0000000000000000000100000000000000000001"), {"2 steps of a mesh"}},
                  {with_number(kMesh, "ESP", 2), {"2 coordinates of a node", "expected 3"}},
                  {with_number(kMesh, "TYP", 1), {"a structured mesh"}},
                  {with_number(kMesh, "REP", 1), {"not Cartesian"}},
                  {without(kStep + "/NOE"), {"no NOE in " + kStep}},
                  {without(kStep + "/NOE/COO"), {"no COO"}},
                  {without(mesh), {"no MAI"}},
                  {without(mesh + "/HE8/NOD"), {"no NOD in " + mesh + "/HE8"}},
                  {renamed(mesh + "/PE6", mesh + "/POE"), {"polyhedra"}},
                  {renamed(mesh + "/PE6", mesh + "/O12"), {"cells of the type O12"}},
                  {renamed(mesh + "/PE6", mesh + "/T10"), {"12 nodes of 2 cells T10"}}});
}

TEST(Med, MeshWithoutVolumeCellsIsRefused) {
  const std::string mesh = kStep + "/MAI/";
  const Change solids = [&](H5::H5File& file) {
    for (const char* type : {"TE4", "PY5", "PE6", "HE8"}) file.unlink(mesh + type);
  };
  expect_refused(kLinear, ":step=3", {{solids, {"no cells with a volume", "TR3"}}});
}

TEST(Med, SizesThatDoNotFitAreRefused) {
  const std::string coordinates = kStep + "/NOE/COO", cells = kStep + "/MAI/TE4/NOD",
                    profile = "/PROFILS/full_NODE/PFL";
  const std::vector<Case> cases = {
      {with_number(cells, "NBR", 3), {"8 nodes of 3 cells TE4"}},
      {with_number(cells, "NBR", -1), {"-1 cells TE4"}},
      {with_values<std::int64_t>(cells, {2, 6, 3, 7, 4, 8, 48, 9}), {"the node 48 of a cell TE4", "there are 47"}},
      {with_values<std::int64_t>(cells, {0, 6, 3, 7, 4, 8, 5, 9}), {"the node 0 of a cell TE4"}},
      {with_number(coordinates, "NBR", 40), {"141 coordinates of 40 nodes"}},
      {with_length(coordinates, 600'000'000), {"promises too much", "600000000 values"}},
      {with_length(kValues + "/CO", 600'000'000), {"promises too much"}},
      {with_length(kValues + "/CO", 138), {"138 values", "expected 3 of each of 47 nodes"}}};
  expect_refused(kLinear, ":displacement=DEPL,step=3", cases);
  std::vector<std::int64_t> nodes(46);
  for (std::size_t n = 0; n < nodes.size(); ++n) nodes[n] = static_cast<std::int64_t>(n) + 2;
  nodes[0] = 48;
  const Change beyond = with_values(profile, nodes);
  nodes[0] = 47;
  expect_refused(kLinear, ":displacement=FULL",
                 {{beyond, {"the node 48 of a profile"}},
                  {with_values(profile, nodes), {"\"FULL\" has the node 47 twice"}},
                  {without("/PROFILS/full_NODE"), {"no full_NODE in /PROFILS"}}});
  const Change twice = [](H5::H5File& file) {
    std::vector<std::int64_t> numbers(58, 7);
    file.openDataSet("/ENS_MAA/quadratic/-0000000000000000001-0000000000000000001/NOE/NUM")
        .write(numbers.data(), H5::PredType::NATIVE_INT64);
  };
  expect_refused(kQuadratic, "", {{twice, {"the node 7 is there twice"}}});
}

TEST(Med, WhatLiesInOtherFilesIsNotRead) {
  const Scratch scratch;
  const std::string name = kStep + "/MAI/TE4", whole = kLinear;
  const auto link = [&](bool external) -> Change {
    return [=](H5::H5File& file) {
      file.unlink(name);
      if (external)
        ASSERT_GE(
            ::H5Lcreate_external(whole.c_str(), name.c_str(), file.getId(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), 0);
      else
        ASSERT_GE(::H5Lcreate_soft((kStep + "/MAI/HE8").c_str(), file.getId(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT),
                  0);
    };
  };
  const Change raw = [&](H5::H5File& file) {
    const std::string coordinates = kStep + "/NOE/COO";
    file.unlink(coordinates);
    H5::DSetCreatPropList list;
    list.setExternal(whole.c_str(), 0, 141 * sizeof(double));
    const hsize_t length = 141;
    H5::DataSet set = file.createDataSet(coordinates, H5::PredType::IEEE_F64LE, H5::DataSpace(1, &length), list);
    const std::int64_t nodes = 47;
    set.createAttribute("NBR", H5::PredType::NATIVE_INT64, H5::DataSpace()).write(H5::PredType::NATIVE_INT64, &nodes);
  };
  expect_refused(kLinear, ":step=3",
                 {{link(true), {"TE4 is a link"}}, {link(false), {"TE4 is a link"}}, {raw, {"in another file"}}});
}

TEST(Med, UnitsAreTakenFromCoordinatesElseFromDisplacements) {
  const Scratch scratch;
  const std::string step = ":displacement=DEPL,step=3";
  MeshFile file = read(changed(scratch, kLinear, with_unit(kMesh, {"m", "m", "m"})) + step);
  EXPECT_EQ(file.header.units, "m");
  EXPECT_EQ(file.header.largest_mm.value_or(0) > 1000, true);
  for (const std::string& unknown : {std::string("INCONNUE"), std::string()}) {  // what Code_Aster writes, and Salome
    file = read(changed(scratch, kLinear, with_unit(kMesh, {unknown, unknown, unknown})) + step);
    EXPECT_EQ(file.header.units, "m") << "of the fields FULL and PART";
    EXPECT_EQ(file.header.units_basis, FieldBasis::stated);
  }
  const Change neither = [](H5::H5File& changing) {
    with_unit(kMesh, {"", "", ""})(changing);
    with_unit(kDepl, {"mm", "mm", "mm"})(changing);
  };
  expect_refused(kLinear, step,
                 {{with_unit(kMesh, {"cm", "cm", "cm"}), {"coordinates in cm", "expected mm or m"}},
                  {with_unit(kMesh, {"mm", "mm", "m"}), {"several units"}},
                  {neither, {"fields in mm and in m"}}});
}

TEST(Med, FieldsOfCellsAndOfOtherMeshesAreNoVectorsHere) {
  const Scratch scratch;
  const std::string vite = "/CHA/RESU____VITE/00000000000000000003-0000000000000000001/";
  const std::string cells = changed(scratch, kLinear, renamed(vite + "NOE", vite + "MAI.TE4"));
  EXPECT_TRUE(says(refused(cells + ":displacement=VITE"), {"no vectors called \"VITE\""}));
  const Change other = [](H5::H5File& file) { file.move(kMesh, "/ENS_MAA/other"); };
  EXPECT_TRUE(says(refused(changed(scratch, kLinear, other) + ":displacement=VITE"), {"no vectors at its vertices"}));
}

TEST(Med, TruncatedAndDamagedFilesAreRefusedSoon) {
  const Scratch scratch;
  const std::string whole = read_bytes(kLinear), path = (scratch / "a.med").string();
  std::chrono::steady_clock::duration longest{};
  const auto timed = [&](const std::string& bytes) {
    write_file(path, bytes);
    const auto begin = std::chrono::steady_clock::now();
    const std::string why = refused(path + ":displacement=DEPL,step=3");
    longest = std::max(longest, std::chrono::steady_clock::now() - begin);
    return why;
  };
  for (std::size_t size = 0; size < whole.size(); size += whole.size() / 60)
    EXPECT_TRUE(says(timed(whole.substr(0, size)), {"InputError", "a.med"})) << size;
  std::mt19937 random(1);
  for (int n = 0; n < 100; ++n) {
    std::string damaged = whole;
    for (int flip = 0; flip < 4; ++flip) damaged[random() % damaged.size()] = static_cast<char>(random());
    const std::string why = timed(damaged);
    EXPECT_TRUE(why.empty() || says(why, {"InputError", "a.med"})) << n;
  }
  EXPECT_LT(longest, std::chrono::seconds(10));
  write_file(path, "no HDF5");
  EXPECT_TRUE(says(refused(path), {"InputError", "HDF5 cannot read", "a.med"}));
}

}  // namespace
}  // namespace tetwarp
