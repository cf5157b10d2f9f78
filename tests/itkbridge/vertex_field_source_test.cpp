// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// A field that comes out of a transform or a displacement image, and goes back into one.
#include <gtest/gtest.h>
#include <itkAffineTransform.h>
#include <itkBSplineTransform.h>
#include <itkTransformFileWriter.h>
#include <itkTxtTransformIO.h>
#include <itkVectorImage.h>

#include <glm/geometric.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "deform/fields/lattice_mesh.h"
#include "io/field_file.h"
#include "io/image_file.h"
#include "itkbridge/itkDisplacementFieldToVertexFieldFilter.h"
#include "itkbridge/itkTransformToVertexFieldFilter.h"
#include "itkbridge/itkVertexFieldToDisplacementFieldFilter.h"
#include "tests/itkbridge/itk_fields.h"
#include "tests/support/program.h"
#include "tests/support/run.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp::test {
namespace {

using Transform = itk::Transform<double, 3, 3>;
using Affine = itk::AffineTransform<double, 3>;
using Spline = itk::BSplineTransform<double, 3, 3>;
using FromTransform = itk::TransformToVertexFieldFilter<>;
using FromImage = itk::DisplacementFieldToVertexFieldFilter<FieldImage>;
using ToImage = itk::VertexFieldToDisplacementFieldFilter<>;

Geometry volume_grid() { return oblique_grid({17, 12, 14}); }

/// Sheared about the middle of the volume, and moved.
Affine::Pointer affine() {
  const auto transform = Affine::New();
  transform->SetCenter(itk_point(centre(volume_grid())));
  transform->Shear(0, 2, 0.2);
  transform->Rotate3D(itk_vector<double>({1, -2, 3}), 0.3);
  transform->Translate(itk_vector<double>({3, 5, 7}));
  return transform;
}

/// A spline from 1 mm before the volume's box to half a millimetre behind it. Further out, where the last vertices of a
/// lattice may be, it leaves points where they are.
Spline::Pointer spline() {
  const auto transform = Spline::New();
  const Geometry grid = volume_grid();
  const auto image = grid_image(grid);
  Spline::PhysicalDimensionsType extent;
  for (unsigned axis = 0; axis < 3; ++axis)
    extent[axis] = image->GetSpacing()[axis] * static_cast<double>(grid.size[static_cast<int>(axis)] - 1) + 1.5;
  transform->SetTransformDomainOrigin(itk_point(grid.origin - grid.direction * glm::dvec3(1)));
  transform->SetTransformDomainDirection(image->GetDirection());
  transform->SetTransformDomainPhysicalDimensions(extent);
  transform->SetTransformDomainMeshSize(Spline::MeshSizeType::Filled(4));
  Spline::ParametersType parameters(transform->GetNumberOfParameters());
  Random random(11);
  for (double& parameter : parameters) parameter = random.real(-3, 3);
  transform->SetParametersByValue(parameters);
  return transform;
}

std::vector<Transform::ConstPointer> both_transforms() { return {affine().GetPointer(), spline().GetPointer()}; }

FromTransform::Pointer over_volume(const Transform& transform, itk::SizeValueType cell_size,
                                   const itk::Index<3>& start = {{0, 0, 0}}) {
  const auto source = FromTransform::New();
  source->SetTransform(&transform);
  source->SetReferenceImage(grid_image(volume_grid(), start));
  source->SetCellSize(cell_size);
  return source;
}

/// Calls `visit(vertex, displacement)` for each vertex of a field's lattice.
template <class Visit>
void for_each_vertex(const itk::VertexField& field, Visit&& visit) {
  const FieldView view = field.GetView();
  for_each_voxel(*view.lattice, [&](const glm::i64vec3& at, std::size_t n) { visit(at, view.displacement[n]); });
}

TEST(TransformToVertexField, EveryVertexGoesToT) {
  for (const Transform::ConstPointer& transform : both_transforms()) {
    const auto source = over_volume(*transform, 3, kFarStart);
    source->Update();
    const itk::VertexField& field = *source->GetOutput();
    EXPECT_TRUE(same_grid(field.GetLattice(), lattice_over(volume_grid(), 3), 1e-9));
    const itk::ImageBase<3>& reference = *source->GetReferenceImage();
    float furthest = 0;
    for_each_vertex(field, [&](const glm::i64vec3& at, const glm::vec3& displacement) {
      itk::Index<3> index = kFarStart;
      for (unsigned axis = 0; axis < 3; ++axis) index[axis] += 3 * at[static_cast<int>(axis)];
      itk::Point<double, 3> rest;
      reference.TransformIndexToPhysicalPoint(index, rest);
      const glm::dvec3 expected = glm_of(transform->TransformPoint(rest) - rest);
      ASSERT_LT(glm::distance(glm::dvec3(displacement), expected), 2e-6) << to_string(at);
      furthest = std::max(furthest, glm::length(displacement));
    });
    EXPECT_GT(furthest, 2);
  }
}

TEST(TransformToVertexField, LatticeOfItsOwnGoesBeforeTheReferenceImage) {
  const Geometry lattice = {{5, 4, 3}, {2.5, 3.5, 4.5}, {-90, 60, 20}, rotation({3, -1, 2}, 0.7)};
  const auto numbers = grid_image(lattice);
  const auto source = over_volume(*affine(), 3);
  source->SetSize(numbers->GetLargestPossibleRegion().GetSize());
  source->SetOutputSpacing(numbers->GetSpacing());
  source->SetOutputOrigin(numbers->GetOrigin());
  source->SetOutputDirection(numbers->GetDirection());
  source->Update();
  EXPECT_EQ(source->GetOutput()->GetLattice(), lattice);
  for_each_vertex(*source->GetOutput(), [&](const glm::i64vec3& at, const glm::vec3& displacement) {
    const glm::dvec3 rest = point_from_index(lattice)(glm::dvec3(at));
    const glm::dvec3 expected = glm_of(affine()->TransformPoint(itk_point(rest))) - rest;
    ASSERT_LT(glm::distance(glm::dvec3(displacement), expected), 2e-6) << to_string(at);
  });
}

TEST(TransformToVertexField, SeesThatTheTransformWasChanged) {
  const auto transform = affine();
  const auto source = over_volume(*transform, 4);
  source->Update();
  const auto before = source->GetOutput()->GetOwner();
  source->Update();
  EXPECT_EQ(source->GetOutput()->GetOwner(), before) << "nothing changed";
  const glm::vec3 first = source->GetOutput()->GetView().displacement[0];
  transform->Translate(itk_vector<double>({1, 0, 0}));
  source->Update();
  EXPECT_NEAR(source->GetOutput()->GetView().displacement[0].x - first.x, 1, 1e-5);
}

TEST(TransformToVertexField, ObserversOfTheFieldRunInTheThreadThatUpdates) {
  std::set<std::thread::id> threads;  // outlives the source, whose end is an event too
  const auto source = over_volume(*affine(), 4);
  source->GetOutput()->AddObserver(itk::ModifiedEvent(),
                                   [&](const itk::EventObject&) { threads.insert(std::this_thread::get_id()); });
  source->Update();
  EXPECT_EQ(threads, std::set{std::this_thread::get_id()});
}

TEST(TransformToVertexField, WithoutALatticeItIsRefused) {
  const auto source = FromTransform::New();
  source->SetTransform(affine());
  EXPECT_TRUE(says(refusal_by_itk([&] { source->Update(); }), {"no lattice", "reference image", "size, spacing"}));
  source->SetReferenceImage(grid_image(volume_grid()));
  source->SetCellSize(0);
  EXPECT_TRUE(says(refusal_by_itk([&] { source->Update(); }), {"cell size", "0"}));
  EXPECT_TRUE(says(refusal_by_itk([&] { FromTransform::New()->Update(); }), {"Transform", "required"}));
}

TEST(TransformToVertexField, GivesTheBitsOfTheProgram) {
  const Scratch scratch;
  write_image(scratch / "x.mha", AnyVolume(volume_grid(), VoxelType::u8).view());
  for (const Transform::ConstPointer& transform : both_transforms()) {
    const auto writer = itk::TransformFileWriterTemplate<double>::New();
    writer->SetTransformIO(itk::TxtTransformIO::New());
    writer->SetFileName((scratch / "transform.tfm").string());
    writer->SetInput(transform);
    writer->Update();
    const auto run = run_tetwarp(scratch.path(), "field transform.tfm --like x.mha -o f.mha --cell-size 2 --overwrite");
    ASSERT_EQ(run.status, 0) << run.err;
    const VertexField expected = read_forward_field(scratch / "f.mha");
    const auto source = over_volume(*transform, 2);
    const auto image = ToImage::New();
    image->SetVertexField(source->GetOutput());
    image->Update();
    EXPECT_TRUE(same_grid(expected.lattice, geometry_of(*image->GetOutput()), 1e-9));
    EXPECT_TRUE(same_bits(expected.displacement, pixels_of(*image->GetOutput()))) << transform->GetNameOfClass();
  }
}

std::vector<glm::vec3> random_vectors(const Geometry& grid, std::uint64_t seed) {
  std::vector<glm::vec3> vectors;
  Random random(seed);
  for_each_voxel(grid, [&](const glm::i64vec3&, std::size_t) {
    vectors.emplace_back(random.real(-3, 3), random.real(-3, 3), random.real(-3, 3));
  });
  return vectors;
}

TEST(DisplacementFieldToVertexField, UsesTheImagesOwnBuffer) {
  const auto image = field_image(volume_grid(), random_vectors(volume_grid(), 1), kFarStart);
  const auto source = FromImage::New();
  source->SetInput(image);
  source->Update();
  const FieldView view = source->GetOutput()->GetView();
  EXPECT_EQ(static_cast<const void*>(view.displacement), image->GetBufferPointer());
  EXPECT_TRUE(same_grid(*view.lattice, volume_grid(), 1e-9));
  EXPECT_EQ(view.memory, Memory::host);
  EXPECT_FALSE(view.mesh);
}

TEST(DisplacementFieldToVertexField, ConvertsDoubles) {
  const std::vector<glm::vec3> vectors = random_vectors(volume_grid(), 2);
  const auto source = itk::DisplacementFieldToVertexFieldFilter<DoubleFieldImage>::New();
  source->SetInput(field_image<double>(volume_grid(), vectors));
  source->Update();
  const FieldView view = source->GetOutput()->GetView();
  EXPECT_TRUE(same_bits(vectors, {view.displacement, view.displacement + vectors.size()}));
}

TEST(DisplacementFieldToVertexField, VectorImagesMustHaveThreeComponents) {
  using Image = itk::VectorImage<float, 3>;
  for (const unsigned components : {2U, 3U}) {
    const auto image = grid_image<Image>(volume_grid());
    image->SetNumberOfComponentsPerPixel(components);
    image->SetRegions(image->GetLargestPossibleRegion());
    image->Allocate(true);
    const auto source = itk::DisplacementFieldToVertexFieldFilter<Image>::New();
    source->SetInput(image);
    if (components == 3) {
      source->Update();
      EXPECT_EQ(static_cast<const void*>(source->GetOutput()->GetView().displacement), image->GetBufferPointer());
    } else {
      EXPECT_TRUE(says(refusal_by_itk([&] { source->Update(); }), {"2 components", "expected 3"}));
    }
  }
}

TEST(DisplacementFieldToVertexField, APartOfAnImageIsNoField) {
  const auto image = grid_image<FieldImage>(volume_grid());
  itk::ImageRegion<3> part = image->GetLargestPossibleRegion();
  part.SetSize(2, 5);
  image->SetBufferedRegion(part);
  image->Allocate(true);
  EXPECT_THROW(hold_displacements(*image), InputError);
}

TEST(DisplacementFieldToVertexField, SeesAChangeOfTheImageAndUpstreamOfIt) {
  const auto transform = affine();
  const auto sampled = over_volume(*transform, 4);
  const auto image = ToImage::New();
  image->SetVertexField(sampled->GetOutput());
  const auto source = FromImage::New();
  source->SetInput(image->GetOutput());
  source->Update();
  const float before = source->GetOutput()->GetView().displacement[7].y;
  const auto owner = source->GetOutput()->GetOwner();
  source->Update();
  EXPECT_EQ(source->GetOutput()->GetOwner(), owner) << "nothing changed";
  transform->Translate(itk_vector<double>({0, 2, 0}));
  source->Update();
  EXPECT_NEAR(source->GetOutput()->GetView().displacement[7].y - before, 2, 1e-5);

  const auto drawn = field_image(volume_grid(), random_vectors(volume_grid(), 3));
  source->SetInput(drawn);
  source->Update();
  drawn->GetBufferPointer()[7][1] = 42;
  drawn->Modified();
  const auto time = source->GetOutput()->GetMTime();
  source->Update();
  EXPECT_EQ(source->GetOutput()->GetView().displacement[7].y, 42);
  EXPECT_GT(source->GetOutput()->GetMTime(), time) << "filters that took it must see that";
}

TEST(DisplacementFieldToVertexField, OutlivesAnImageThatReleasesItsData) {
  const auto sampled = over_volume(*spline(), 3);
  const auto image = ToImage::New();
  image->SetVertexField(sampled->GetOutput());
  image->Update();
  const std::vector<glm::vec3> expected = pixels_of(*image->GetOutput());
  image->GetOutput()->ReleaseDataFlagOn();
  const auto source = FromImage::New();
  source->SetInput(image->GetOutput());
  source->Update();
  ASSERT_TRUE(image->GetOutput()->GetDataReleased());
  const FieldView view = source->GetOutput()->GetView();
  EXPECT_TRUE(same_bits(expected, {view.displacement, view.displacement + expected.size()}));
  image->Modified();
  source->Update();  // the image is made anew
  const FieldView again = source->GetOutput()->GetView();
  EXPECT_TRUE(same_bits(expected, {again.displacement, again.displacement + expected.size()}));
}

/// The filter that made an image writes into the same buffer again, or frees it, but not if the image was disconnected.
TEST(DisplacementFieldToVertexField, KeepsTheFieldOfADisconnectedImage) {
  const auto transform = affine();
  const auto sampled = over_volume(*transform, 4);
  const auto made = ToImage::New();
  made->SetVertexField(sampled->GetOutput());
  made->Update();
  const itk::SmartPointer<FieldImage> image = made->GetOutput();
  image->DisconnectPipeline();
  const auto source = FromImage::New();
  source->SetInput(image);
  source->Update();
  const std::vector<glm::vec3> expected = pixels_of(*image);
  transform->Translate(itk_vector<double>({1, 2, 3}));
  made->Update();
  EXPECT_NE(made->GetOutput()->GetBufferPointer()[0], image->GetBufferPointer()[0]);
  const FieldView view = source->GetOutput()->GetView();
  EXPECT_TRUE(same_bits(expected, {view.displacement, view.displacement + expected.size()}));
}

TEST(VertexFieldToDisplacementField, RoundTripKeepsEveryBit) {
  const VertexField field{volume_grid(), random_vectors(volume_grid(), 4)};
  const auto image = ToImage::New();
  image->SetVertexField(itk_field(field));
  const auto back = FromImage::New();
  back->SetInput(image->GetOutput());
  back->Update();
  const FieldView view = back->GetOutput()->GetView();
  EXPECT_EQ(*view.lattice, field.lattice);
  EXPECT_TRUE(same_bits(field.displacement, {view.displacement, view.displacement + field.displacement.size()}));
}

TEST(VertexFieldToDisplacementField, FieldsThatAreNoImageAreRefused) {
  const VertexField lattice{volume_grid(), random_vectors(volume_grid(), 5)};
  const auto image = ToImage::New();
  image->SetVertexField(itk_field({.lattice = {}, .displacement = {}, .mesh = mesh_of(lattice)}));
  EXPECT_TRUE(says(refusal_by_itk([&] { image->Update(); }), {"mesh", "VertexFieldToMeshFilter"}));
  const auto on_device = itk::VertexField::New();
  FieldView view = tetwarp::view(lattice);
  view.memory = Memory::device;
  on_device->SetView(view, std::make_shared<int>());
  image->SetVertexField(on_device);
  EXPECT_TRUE(says(refusal_by_itk([&] { image->Update(); }), {"device memory"}));
  image->SetVertexField(itk::VertexField::New());
  EXPECT_TRUE(says(refusal_by_itk([&] { image->Update(); }), {"there is no field"}));
}

TEST(VertexFieldObject, WrongCountsAreRefused) {
  VertexField field = uniform_field(volume_grid(), glm::vec3(1));
  field.displacement.pop_back();
  EXPECT_TRUE(says(refusal_by_itk([&] { itk_field(field); }), {std::to_string(field.displacement.size())}));
  VertexField meshed{.lattice = {}, .displacement = {}, .mesh = mesh_of(uniform_field(volume_grid(), glm::vec3(1)))};
  meshed.mesh.rest.pop_back();
  EXPECT_TRUE(says(refusal_by_itk([&] { itk_field(meshed); }), {std::to_string(meshed.mesh.rest.size())}));
}

TEST(VertexFieldObject, ARefusedFieldLeavesTheOneThatWasThere) {
  const auto field = itk_field(uniform_field(volume_grid(), glm::vec3(1)));
  const auto owner = field->GetOwner();
  EXPECT_THROW(field->SetField({volume_grid(), {}}), itk::ExceptionObject);
  EXPECT_EQ(field->GetOwner(), owner);
}

TEST(VertexFieldObject, GraftSharesTheField) {
  const auto field = itk_field(uniform_field(volume_grid(), glm::vec3(1)));
  const auto graft = itk::VertexField::New();
  const auto time = graft->GetMTime();
  graft->Graft(field);
  EXPECT_EQ(graft->GetOwner(), field->GetOwner());
  EXPECT_EQ(graft->GetView().displacement, field->GetView().displacement);
  EXPECT_GT(graft->GetMTime(), time);
  EXPECT_TRUE(says(refusal_by_itk([&] { graft->Graft(grid_image(volume_grid())); }), {"VertexField", "found Image"}));
  EXPECT_TRUE(says(refusal_by_itk([&] { graft->Graft(nullptr); }), {"VertexField", "found nothing"}));
}

TEST(VertexFieldObject, InitializeForgetsTheField) {
  const auto field = itk_field(uniform_field(volume_grid(), glm::vec3(1)));
  const auto graft = itk::VertexField::New();
  graft->Graft(field);
  field->Initialize();
  EXPECT_TRUE(says(refusal_by_itk([&] { field->GetView(); }), {"there is no field", "SetField"}));
  EXPECT_TRUE(says(refusal_by_itk([&] { field->GetLattice(); }), {"there is no field"}));
  EXPECT_EQ(graft->GetView().displacement[0], glm::vec3(1)) << "who shares it keeps it";
}

TEST(VertexFieldObject, AMeshAloneHasNoLattice) {
  const auto field =
      itk_field({.lattice = {}, .displacement = {}, .mesh = mesh_of(uniform_field(volume_grid(), glm::vec3(1)))});
  EXPECT_TRUE(says(refusal_by_itk([&] { field->GetLattice(); }), {"no lattice"}));
}

TEST(VertexFieldObject, PrintSaysWhatItHolds) {
  const auto printed = [](const itk::Object& object) {
    std::ostringstream text;
    object.Print(text);
    return text.str();
  };
  const VertexField lattice = uniform_field(volume_grid(), glm::vec3(1));
  EXPECT_TRUE(says(printed(*itk::VertexField::New()), {"VertexField", "Field: (none)"}));
  EXPECT_TRUE(says(printed(*itk_field(lattice)), {"Lattice: 17 x 12 x 14 vertices", "LatticeSpacing: [0.7, 0.8, 1.25]",
                                                  "LatticeOrigin: [-101.3, ", "MeshTetrahedra: 0", "Memory: host"}));
  EXPECT_TRUE(says(printed(*itk_field({.lattice = {}, .displacement = {}, .mesh = mesh_of(lattice)})),
                   {"MeshVertices: 2856", "MeshTetrahedra: " + std::to_string(5 * 16 * 11 * 13)}));
  EXPECT_TRUE(says(printed(*over_volume(*affine(), 6)), {"TransformToVertexFieldFilter", "CellSize: 6"}));
}

}  // namespace
}  // namespace tetwarp::test
