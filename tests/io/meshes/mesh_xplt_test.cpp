// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Plot files of FEBio. tests/support/make_xplt.py wrote those of the corpus, by the layout of FEBio 2 and of FEBio 4.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "io/mesh_file.h"
#include "tests/support/image_samples.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

const std::filesystem::path kCorpus = std::filesystem::path(TETWARP_FUZZ_CORPUS) / "mesh-xplt";

std::string refused(const std::filesystem::path& path, const std::string& options = "") {
  return refusal([&] { read_mesh_file(parse_field_source(path.string() + (options.empty() ? "" : ":" + options))); });
}

TEST(Febio, MeshAndDisplacementOfAStateAreReadFromBothLayouts) {
  for (const char* name : {"febio2.xplt", "febio4.xplt"}) {
    const std::string path = (kCorpus / name).string();
    const MeshFile file = read_mesh_file(parse_field_source(path + ":step=1"));
    EXPECT_EQ(file.header.displacement, "displacement, step 1") << name;
    EXPECT_EQ(file.header.arrays, (std::vector<std::string>{"displacement, step 0", "displacement, step 1"}))
        << "and no pressure, " << name;
    EXPECT_EQ(file.header.cells[2], 1U) << "wedges";
    EXPECT_EQ(file.header.cells[3], 1U) << "hexahedra";
    ASSERT_EQ(file.mesh.rest.size(), 10U);
    for (std::size_t v = 0; v < file.mesh.rest.size(); ++v) {
      const glm::dvec3 at = file.mesh.rest[v];
      EXPECT_EQ(glm::dvec3(file.mesh.displacement[v]), glm::dvec3(at.z / 4, 0, at.x / 4)) << name << v;
    }
    double volume = 0;
    for (const glm::u32vec4& t : file.mesh.tetrahedra) {
      const glm::dvec3 a = file.mesh.rest[t[0]];
      const double six =
          glm::dot(file.mesh.rest[t[1]] - a, glm::cross(file.mesh.rest[t[2]] - a, file.mesh.rest[t[3]] - a));
      EXPECT_GT(six, 0) << name;
      volume += six / 6;
    }
    EXPECT_NEAR(volume, 8 + 4, 1e-12) << name;
    std::string notes;
    for (const std::string& note : file.header.notes) notes += note + "\n";
    EXPECT_TRUE(says(notes, {"1 elements of the type tri3 are left out"}));
    EXPECT_TRUE(says(refused(path), {"which vectors", "displacement, step 0"}));
    EXPECT_TRUE(says(refused(path, "step=2"), {"no step 2"}));
  }
  EXPECT_EQ(read_mesh_header(kCorpus / "febio4.xplt").format, "FEBio plot file, version 53");
}

TEST(Febio, DamagedFilesAreRefused) {
  const Scratch scratch;
  for (const char* name : {"febio2.xplt", "febio4.xplt"}) {
    const std::string whole = read_bytes(kCorpus / name);
    const std::size_t states = whole.find(std::string("\0\0\0\x02", 4));
    for (std::size_t size = 0; size < whole.size(); size += 7) {
      write_file(scratch / "a.xplt", whole.substr(0, size));
      const std::string why = refused(scratch / "a.xplt", "step=1");
      EXPECT_TRUE(says(why, {"InputError", "a.xplt"})) << size;  // a state that is missing is no step
    }
    ASSERT_NE(states, std::string::npos);
    const auto replaced = [&](const std::string& what, const std::string& by) {
      std::string changed = whole;
      const std::size_t at = changed.find(what);
      EXPECT_NE(at, std::string::npos);
      changed.replace(at, what.size(), by);
      write_file(scratch / "a.xplt", changed);
      return refused(scratch / "a.xplt", "step=1");
    };
    EXPECT_TRUE(says(replaced("BEF", "FEB"), {"no plot file of FEBio", "a.xplt"}));
    // A chunk of one number: its kind, four bytes, and the number.
    const auto with_number = [&](const std::string& kind, char was, char is) {
      const std::string head = kind + std::string("\x04\0\0\0", 4);
      return replaced(head + was, head + is);
    };
    const std::string compression("\x04\0\x01\x01", 4), type("\x02\x21\x04\x01", 4);
    EXPECT_TRUE(says(with_number(compression, '\0', '\1'), {"a compressed plot file", "<compression>0"}));
    EXPECT_TRUE(says(with_number(type, '\0', '\x63'), {"elements of the type 99"}));
    EXPECT_TRUE(says(with_number(type, '\0', '\2'), {"elements tet4 of"}));
  }
}

}  // namespace
}  // namespace tetwarp
