// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Fields of tetrahedra as meshes of ITK, and points and surfaces that a field moves.
#include <gtest/gtest.h>
#include <itkCompositeTransform.h>
#include <itkDefaultDynamicMeshTraits.h>
#include <itkHexahedronCell.h>
#include <itkTransformMeshFilter.h>
#include <itkTranslationTransform.h>
#include <itkTriangleCell.h>

#include <glm/geometric.hpp>

#include "deform/fields/formula.h"
#include "deform/fields/lattice_mesh.h"
#include "itkbridge/itkMeshToVertexFieldFilter.h"
#include "itkbridge/itkVertexFieldToMeshFilter.h"
#include "itkbridge/itkVertexFieldTransform.h"
#include "tests/itkbridge/itk_fields.h"
#include "tests/support/run.h"
#include "tests/support/says.h"

namespace tetwarp::test {
namespace {

using Displacement = itk::Vector<float, 3>;
/// Points in a map, so that their identifiers may have gaps; coordinates in double.
using Mesh = itk::Mesh<Displacement, 3, itk::DefaultDynamicMeshTraits<Displacement, 3, 3, double>>;
/// What the filters have when nothing is said: points in a vector, coordinates in float.
using PlainMesh = itk::Mesh<Displacement, 3>;
using ScalarMesh = itk::Mesh<float, 3, itk::DefaultDynamicMeshTraits<float, 3, 3, double>>;
using FromMesh = itk::MeshToVertexFieldFilter<Mesh>;
using ToMesh = itk::VertexFieldToMeshFilter<Mesh>;

Geometry volume_grid() { return oblique_grid({14, 12, 10}); }

itk::IdentifierType point_id(std::size_t n) { return 40 + 7 * n; }

template <template <class> class Cell, class TMesh>
void add_cell(TMesh& mesh, itk::IdentifierType id, const std::vector<itk::IdentifierType>& points) {
  typename TMesh::CellAutoPointer cell;
  cell.TakeOwnership(new Cell<typename TMesh::CellType>);
  for (std::size_t n = 0; n < points.size(); ++n) cell->SetPointId(static_cast<int>(n), points[n]);
  mesh.SetCell(id, cell);
}

/// A mesh whose identifiers have gaps. Points and cells are put in from the last to the first.
template <class TMesh = Mesh>
typename TMesh::Pointer with_gaps(const TetrahedralMesh& from, bool deformed = false) {
  const auto mesh = TMesh::New();
  for (std::size_t n = from.rest.size(); n-- > 0;) {
    const glm::dvec3 at = from.rest[n] + (deformed ? glm::dvec3(from.displacement[n]) : glm::dvec3(0));
    typename TMesh::PointType point;
    for (unsigned axis = 0; axis < 3; ++axis)
      point[axis] = static_cast<typename TMesh::CoordRepType>(at[static_cast<int>(axis)]);
    mesh->SetPoint(point_id(n), point);
  }
  for (std::size_t n = from.tetrahedra.size(); n-- > 0 && !deformed;) {
    const glm::u32vec4& t = from.tetrahedra[n];
    add_cell<itk::TetrahedronCell>(*mesh, 5 + 3 * n, {point_id(t.x), point_id(t.y), point_id(t.z), point_id(t.w)});
  }
  return mesh;
}

Mesh::Pointer with_data(const TetrahedralMesh& from) {
  const auto mesh = with_gaps(from);
  for (std::size_t n = 0; n < from.rest.size(); ++n)
    mesh->SetPointData(point_id(n), itk_vector<float>(from.displacement[n]));
  return mesh;
}

std::string refused_mesh(const Mesh* mesh) {
  const auto source = FromMesh::New();
  source->SetInput(mesh);
  return refusal_by_itk([&] { source->Update(); });
}

void expect_same_mesh(const TetrahedralMesh& expected, const itk::VertexField& field) {
  const FieldView view = field.GetView();
  ASSERT_TRUE(view.mesh);
  EXPECT_FALSE(view.lattice);
  EXPECT_TRUE(same_bits(expected.rest, view.mesh->rest));
  EXPECT_TRUE(same_bits(expected.displacement, view.mesh->displacement));
  EXPECT_TRUE(same_bits(expected.tetrahedra, view.mesh->tetrahedra));
}

TEST(MeshToVertexField, IdentifiersMayHaveGapsAndTheirOrderIsKept) {
  const TetrahedralMesh mesh = mesh_of(shaken(volume_grid(), 4));
  const auto source = FromMesh::New();
  source->SetInput(with_data(mesh));
  source->Update();
  expect_same_mesh(mesh, *source->GetOutput());
}

TEST(MeshToVertexField, DeformedMeshSaysWhatPointDataSay) {
  TetrahedralMesh mesh = mesh_of(shaken(unit_grid({14, 12, 10}), 4));  // rest plus displacement is exact in double
  const auto source = FromMesh::New();
  source->SetInput(with_gaps(mesh));
  source->SetDeformedMesh(with_gaps(mesh, true));
  source->Update();
  expect_same_mesh(mesh, *source->GetOutput());
  // A deformed mesh is used rather than point data, whatever these are.
  const auto scalars = with_gaps<ScalarMesh>(mesh);
  for (std::size_t n = 0; n < mesh.rest.size(); ++n) scalars->SetPointData(point_id(n), 42);
  const auto of_scalars = itk::MeshToVertexFieldFilter<ScalarMesh, Mesh>::New();
  of_scalars->SetInput(scalars);
  of_scalars->SetDeformedMesh(with_gaps(mesh, true));
  of_scalars->Update();
  EXPECT_TRUE(same_bits(mesh.displacement, of_scalars->GetOutput()->GetView().mesh->displacement));
  of_scalars->SetDeformedMesh(nullptr);
  EXPECT_TRUE(says(refusal_by_itk([&] { of_scalars->Update(); }), {"point 40", "1 components", "expected 3"}));
}

TEST(MeshToVertexField, SeesThatTheDeformedMeshMoved) {
  const TetrahedralMesh mesh = mesh_of(shaken(volume_grid(), 4));
  const auto deformed = with_gaps(mesh, true);
  const auto source = FromMesh::New();
  source->SetInput(with_gaps(mesh));
  source->SetDeformedMesh(deformed);
  source->Update();
  const float before = source->GetOutput()->GetView().mesh->displacement[3].x;
  Mesh::PointType point = deformed->GetPoint(point_id(3));
  point[0] += 2;
  deformed->SetPoint(point_id(3), point);
  deformed->Modified();
  source->Update();
  EXPECT_NEAR(source->GetOutput()->GetView().mesh->displacement[3].x - before, 2, 1e-5);
}

TEST(MeshToVertexField, TrianglesAreLeftOutAndHexahedraRefused) {
  const TetrahedralMesh mesh = mesh_of(shaken(volume_grid(), 4));
  const auto mixed = with_data(mesh);
  add_cell<itk::TriangleCell>(*mixed, 0, {40, 47, 54});
  add_cell<itk::TriangleCell>(*mixed, 6, {40, 47, 54});
  const auto source = FromMesh::New();
  source->SetInput(mixed);
  source->Update();
  expect_same_mesh(mesh, *source->GetOutput());
  add_cell<itk::HexahedronCell>(*mixed, 7, {40, 47, 54, 61, 68, 75, 82, 89});
  EXPECT_TRUE(says(refused_mesh(mixed), {"cell 7", "HEXAHEDRON", "expected tetrahedra"}));
}

TEST(MeshToVertexField, WhatIsMissingIsRefused) {
  const TetrahedralMesh mesh = mesh_of(shaken(volume_grid(), 6));
  EXPECT_TRUE(says(refused_mesh(with_gaps(mesh)), {"point 40 has no displacement", "deformed mesh"}));
  const auto beyond = with_data(mesh);
  add_cell<itk::TetrahedronCell>(*beyond, 6, {40, 47, 54, 41});
  EXPECT_TRUE(says(refused_mesh(beyond), {"cell 6", "point 41"}));
  const auto source = FromMesh::New();
  source->SetInput(with_data(mesh));
  const auto deformed = with_gaps(mesh, true);
  deformed->GetPoints()->DeleteIndex(point_id(2));
  source->SetDeformedMesh(deformed);
  EXPECT_TRUE(says(refusal_by_itk([&] { source->Update(); }), {"deformed mesh has no point 54"}));
  EXPECT_TRUE(says(refused_mesh(nullptr), {"Input", "required"}));
}

TEST(MeshToVertexField, EmptyMeshesAreRefused) {
  EXPECT_TRUE(says(refused_mesh(Mesh::New()), {"no tetrahedra"}));
  const auto surface = with_data(mesh_of(shaken(volume_grid(), 6)));
  surface->SetCells(Mesh::CellsContainer::New());
  EXPECT_TRUE(says(refused_mesh(surface), {"no tetrahedra"}));
  add_cell<itk::TriangleCell>(*surface, 0, {40, 47, 54});
  EXPECT_TRUE(says(refused_mesh(surface), {"no tetrahedra"}));
}

/// One volume, and all maps, through a field.
Outcome<float> resampled(const Geometry& grid, const FieldView& field) {
  Volume<float> source{grid, {}};
  for_each_voxel(grid, [&](const glm::i64vec3& v, std::size_t) {
    source.voxels.push_back(static_cast<float>(v.x * v.x + 3 * v.y * v.z - 7 * v.z));
  });
  const auto resampler = make_cpu_resampler(grid);
  resampler->set_field(field);
  return run(*resampler, source);
}

/// Turns a lattice into a mesh of ITK and back into a field: both resample to the same bits.
template <class TMesh>
void expect_same_after_mesh(const Geometry& grid) {
  const VertexField field = shaken(grid, 3);
  const auto mesh = itk::VertexFieldToMeshFilter<TMesh>::New();
  mesh->SetVertexField(itk_field(field));
  const auto back = itk::MeshToVertexFieldFilter<TMesh>::New();
  back->SetInput(mesh->GetOutput());
  back->Update();
  const Outcome<float> expected = resampled(grid, view(field, Outside::background));
  expect_same_outcome(expected, resampled(grid, back->GetOutput()->GetView(Outside::background)));
  EXPECT_GT(expected.report.covered, 500u);
  EXPECT_EQ(mesh->GetOutput()->GetNumberOfPoints(), field.displacement.size());
  EXPECT_EQ(mesh->GetOutput()->GetNumberOfCells(), mesh_of(field).tetrahedra.size());
}

TEST(VertexFieldToMesh, MeshOfALatticeResamplesToTheSameBits) {
  expect_same_after_mesh<PlainMesh>(unit_grid({14, 12, 10}));
  expect_same_after_mesh<Mesh>(volume_grid());
}

TEST(VertexFieldToMesh, DeformedPointsAreWhereTheyGo) {
  const VertexField field = shaken(volume_grid(), 4);
  const TetrahedralMesh expected = mesh_of(field);
  const auto rest = ToMesh::New(), deformed = ToMesh::New();
  rest->SetVertexField(itk_field(field));
  deformed->SetVertexField(rest->GetVertexField());
  deformed->DeformedOn();
  rest->Update();
  deformed->Update();
  for (std::size_t n = 0; n < expected.rest.size(); ++n) {
    ASSERT_EQ(glm_of(rest->GetOutput()->GetPoint(n)), expected.rest[n]);
    ASSERT_EQ(glm_of(deformed->GetOutput()->GetPoint(n)), expected.rest[n] + glm::dvec3(expected.displacement[n]));
    Displacement of_rest, of_deformed;
    ASSERT_TRUE(rest->GetOutput()->GetPointData(n, &of_rest));
    ASSERT_TRUE(deformed->GetOutput()->GetPointData(n, &of_deformed));
    ASSERT_EQ(glm::vec3(glm_of(of_rest)), expected.displacement[n]);
    ASSERT_EQ(of_rest, of_deformed);
  }
  // The two meshes together say the field again.
  const auto back = FromMesh::New();
  back->SetInput(rest->GetOutput());
  back->SetDeformedMesh(deformed->GetOutput());
  back->Update();
  const FieldView view = back->GetOutput()->GetView();
  ASSERT_EQ(view.mesh->displacement.size(), expected.displacement.size());
  for (std::size_t n = 0; n < expected.rest.size(); ++n)
    ASSERT_LT(glm::distance(view.mesh->displacement[n], expected.displacement[n]), 1e-6f);
}

TEST(VertexFieldToMesh, FieldsWithoutUsableVerticesAreRefused) {
  const auto refused = [](const FieldView& view) {
    const auto field = itk::VertexField::New();
    field->SetView(view, std::make_shared<int>());
    const auto mesh = ToMesh::New();
    mesh->SetVertexField(field);
    return refusal_by_itk([&] { mesh->Update(); });
  };
  const VertexField lattice = shaken(volume_grid(), 4);
  FieldView device = view(lattice);
  device.memory = Memory::device;
  EXPECT_TRUE(says(refused(device), {"host memory"}));
  TetrahedralMesh bad = mesh_of(lattice);
  bad.displacement.pop_back();
  EXPECT_TRUE(says(refused({.mesh = &bad}), {"expected one for each vertex"}));
}

itk::VertexFieldTransform::Pointer transform_of(const VertexField& field) {
  const auto transform = itk::VertexFieldTransform::New();
  transform->SetVertexField(itk_field(field), grid_image(volume_grid(), kFarStart));
  return transform;
}

/// Points in and around a grid.
std::vector<glm::dvec3> points_around(const Geometry& grid) {
  Random random(5);
  std::vector<glm::dvec3> points;
  for (int n = 0; n < 3000; ++n) {
    const glm::dvec3 share(random.real(-0.3, 1.3), random.real(-0.3, 1.3), random.real(-0.3, 1.3));
    points.push_back(point_from_index(grid)(share * glm::dvec3(grid.size)));
  }
  return points;
}

TEST(VertexFieldTransform, MovesPointsAsTheCoreDoesBitForBit) {
  const VertexField lattice = shaken(volume_grid(), 3);
  for (const VertexField& field : {lattice, VertexField{.lattice = {}, .displacement = {}, .mesh = mesh_of(lattice)}}) {
    const auto transform = transform_of(field);
    const std::vector<glm::dvec3> points = points_around(volume_grid());
    std::vector<glm::dvec3> expected = points, found;
    // The grid as the image says it: its origin is that of another index.
    const Geometry grid = geometry_of(*grid_image(volume_grid(), kFarStart));
    const std::vector<PointStatus> status = move_points(grid, view(field, Outside::rest), expected);
    std::size_t outside = 0;
    for (std::size_t n = 0; n < points.size(); ++n) {
      found.push_back(glm_of(transform->TransformPoint(itk_point(points[n]))));
      ASSERT_EQ(transform->IsInside(itk_point(points[n])), status[n] == PointStatus::moved);
      if (status[n] == PointStatus::moved) continue;
      ++outside;
      ASSERT_EQ(found.back(), points[n]) << "outside it stays";
    }
    EXPECT_TRUE(same_bits(expected, found));
    EXPECT_GT(outside, 500u);
    EXPECT_LT(outside, 2500u);
  }
}

TEST(VertexFieldTransform, WorksInACompositeTransformAndItsClone) {
  const auto transform = transform_of(shaken(volume_grid(), 3));
  const auto shift = itk::TranslationTransform<double, 3>::New();
  shift->Translate(itk_vector<double>({30, -20, 10}));
  const auto both = itk::CompositeTransform<double, 3>::New();
  both->AddTransform(shift);
  both->AddTransform(transform);  // what is added last is applied first
  const auto clone = both->Clone();
  transform->SetVertexField(itk_field(uniform_field(volume_grid(), glm::vec3(0))), grid_image(volume_grid()));
  const auto unchanged = transform_of(shaken(volume_grid(), 3));
  for (const glm::dvec3& point : points_around(volume_grid())) {
    const glm::dvec3 shifted = glm_of(unchanged->TransformPoint(itk_point(point))) + glm::dvec3(30, -20, 10);
    ASSERT_EQ(glm_of(clone->TransformPoint(itk_point(point))), shifted);
    ASSERT_LT(glm::distance(glm_of(both->TransformPoint(itk_point(point))), point + glm::dvec3(30, -20, 10)), 1e-12);
  }
}

TEST(VertexFieldTransform, MovesASurfaceInTransformMeshFilter) {
  const auto surface = Mesh::New();
  const std::vector<glm::dvec3> points = points_around(volume_grid());
  for (std::size_t n = 0; n < points.size(); ++n) surface->SetPoint(n, itk_point(points[n]));
  add_cell<itk::TriangleCell>(*surface, 0, {0, 1, 2});
  const auto transform = transform_of(shaken(volume_grid(), 3));
  const auto filter = itk::TransformMeshFilter<Mesh, Mesh, itk::VertexFieldTransform>::New();
  filter->SetInput(surface);
  filter->SetTransform(transform);
  filter->Update();
  for (std::size_t n = 0; n < points.size(); ++n)
    ASSERT_EQ(filter->GetOutput()->GetPoint(n), transform->TransformPoint(itk_point(points[n])));
  EXPECT_EQ(filter->GetOutput()->GetNumberOfCells(), 1u);
}

TEST(VertexFieldTransform, KeepsItsFieldWhenTheOneThatItWasGivenIsGone) {
  const auto field = itk_field(shaken(volume_grid(), 3));
  const auto transform = itk::VertexFieldTransform::New();
  transform->SetVertexField(field, grid_image(volume_grid()));
  const itk::Point<double, 3> point = itk_point(centre(volume_grid()));
  const auto moved = transform->TransformPoint(point);
  EXPECT_NE(moved, point);
  field->Initialize();
  EXPECT_EQ(transform->TransformPoint(point), moved);
}

TEST(VertexFieldTransform, SaysWhatItCannotDo) {
  const auto transform = itk::VertexFieldTransform::New();
  const itk::Point<double, 3> point = itk_point(centre(volume_grid()));
  const auto field = itk_field(shaken(volume_grid(), 3));
  const auto grid = grid_image(volume_grid());
  EXPECT_TRUE(says(refusal_by_itk([&] { transform->TransformPoint(point); }), {"SetVertexField"}));
  EXPECT_TRUE(says(refusal_by_itk([&] { transform->IsInside(point); }), {"SetVertexField"}));
  EXPECT_TRUE(says(refusal_by_itk([&] { transform->SetVertexField(nullptr, grid); }), {"a field", "none"}));
  EXPECT_TRUE(says(refusal_by_itk([&] { transform->SetVertexField(field, nullptr); }), {"image", "none"}));
  const auto empty = itk::VertexField::New();
  EXPECT_TRUE(says(refusal_by_itk([&] { transform->SetVertexField(empty, grid); }), {"there is no field"}));
  const auto flat = itk_field(uniform_field(unit_grid({1, 5, 5}), glm::vec3(0)));
  EXPECT_TRUE(says(refusal_by_itk([&] { transform->SetVertexField(flat, grid); }), {"1 x 5 x 5", "at least 2"}));
  VertexField broken = shaken(volume_grid(), 20);
  broken.displacement[0].y = NAN;
  transform->SetVertexField(itk_field(broken), grid);
  EXPECT_TRUE(says(refusal_by_itk([&] { transform->TransformPoint(point); }), {"vertex (0, 0, 0)", "not finite"}));
  transform->SetVertexField(field, grid);
  EXPECT_TRUE(says(refusal_by_itk([&] { transform->TransformVector(itk_vector<double>({1, 0, 0})); }), {"place"}));
  itk::VertexFieldTransform::JacobianType jacobian;
  EXPECT_TRUE(says(refusal_by_itk([&] { transform->ComputeJacobianWithRespectToParameters(point, jacobian); }),
                   {"no parameters"}));
  EXPECT_EQ(transform->GetNumberOfParameters(), 0u);
  EXPECT_EQ(transform->GetInverseTransform(), nullptr);
}

}  // namespace
}  // namespace tetwarp::test
