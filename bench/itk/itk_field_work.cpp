// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Fields alone: inverses, determinants and transforms, by ITK's filters and by ours.
#include <itkBSplineTransform.h>
#include <itkDisplacementFieldJacobianDeterminantFilter.h>
#include <itkImageRegionIteratorWithIndex.h>
#include <itkInvertDisplacementFieldImageFilter.h>
#include <itkMultiThreaderBase.h>
#include <itkTransformToDisplacementFieldFilter.h>

#include <algorithm>
#include <cmath>

#include "bench/itk/itk_images.h"
#include "itkbridge/itkDisplacementFieldToVertexFieldFilter.h"
#include "itkbridge/itkExactInvertDisplacementFieldImageFilter.h"
#include "itkbridge/itkTransformToVertexFieldFilter.h"
#include "itkbridge/itkVertexFieldToJacobianDeterminantFilter.h"

namespace tetwarp::bench {

namespace {

using Invert = itk::InvertDisplacementFieldImageFilter<ItkField, ItkField>;
using ExactInvert = itk::ExactInvertDisplacementFieldImageFilter<ItkField>;
using Determinant = itk::VertexFieldToJacobianDeterminantFilter<>;
using ItkDeterminant = itk::DisplacementFieldJacobianDeterminantFilter<ItkField, float>;
using Scalars = itk::Image<float, 3>;
using Spline = itk::BSplineTransform<double, 3, 3>;
using ToVertexField = itk::TransformToVertexFieldFilter<double>;
using ToDisplacementField = itk::TransformToDisplacementFieldFilter<ItkField, double>;
using Filters = std::vector<itk::ProcessObject::Pointer>;

ItkWork make_inverse(const ItkRequest& request, const ItkFiles& files) {
  const ItkField::Pointer field = itk_read<ItkField>(files.forward(request.field, request.cell_size));
  Filters filters;
  if (request.method == "invert") {
    const auto filter = ExactInvert::New();
    filter->SetInput(field);
    filter->SetBackend("cpu");
    filters.emplace_back(filter.GetPointer());
  } else {
    const auto filter = Invert::New();
    filter->SetInput(field);
    filter->SetEnforceBoundaryCondition(request.method == "itk-invert");
    filters.emplace_back(filter.GetPointer());
  }
  return image_work<ItkField>(std::move(filters), bytes_of(*field), [=](const ItkField& found) {
    return with_truth(files.inverse(request.field, request.cell_size),
                      [&](const TrueInverse& truth) { return compare_inverse_field(vectors_of(found), truth); });
  });
}

/// Ours, at the deformed places.
ItkWork make_determinant(const ItkRequest& request, const ItkFiles& files) {
  const ItkField::Pointer field = itk_read<ItkField>(files.forward(request.field, request.cell_size));
  const auto vertices = itk::DisplacementFieldToVertexFieldFilter<ItkField>::New();
  vertices->SetInput(field);
  const auto filter = Determinant::New();
  filter->SetVertexField(vertices->GetOutput());
  filter->SetOutputParametersFromImage(field);
  filter->SetBackend("cpu");
  const auto deviation = [=](const Scalars& found) {
    return with_truth(files.inverse(request.field, request.cell_size), [&](const TrueInverse& truth) {
      return compare_determinants(values_of(found), make_smooth_field(request.field, truth.grid->size), truth);
    });
  };
  return image_work<Scalars>(Filters{vertices.GetPointer(), filter.GetPointer()}, bytes_of(*field), deviation);
}

/// ITK's, where the vertices rest.
ItkWork make_itk_determinant(const ItkRequest& request, const ItkFiles& files) {
  const ItkField::Pointer field = itk_read<ItkField>(files.forward(request.field, request.cell_size));
  const auto filter = ItkDeterminant::New();
  filter->SetInput(field);
  return image_work<Scalars>(Filters{filter.GetPointer()}, bytes_of(*field), [=](const Scalars& found) {
    const Geometry grid = geometry_of(found);
    return compare_rest_determinants(values_of(found), make_smooth_field(request.field, grid.size), grid);
  });
}

/// A B-spline transform of a closed form: splines of third order are exact for squares.
struct SquareSpline {
  Geometry lattice;        ///< that is sampled
  glm::dvec3 low, length;  ///< of the spline's domain, which holds it
  glm::i64vec3 cells;

  explicit SquareSpline(const Geometry& volume, std::int64_t cell_size) : lattice(lattice_over(volume, cell_size)) {
    constexpr double kMargin = 4, kAbout = 32;  // voxels: around the lattice, between control points
    const glm::dvec3 extent = glm::dvec3(lattice.size - std::int64_t{1}) * lattice.spacing;
    low = lattice.origin - kMargin;
    length = extent + 2 * kMargin;
    cells = glm::max(glm::i64vec3(glm::round(length / kAbout)), std::int64_t{1});
  }

  /// Component a is 8 mm at the domain's ends along axis a + 1, and 0 half-way between.
  glm::dvec3 operator()(const glm::dvec3& point) const {
    const glm::dvec3 along = (point - low) / length * 2.0 - 1.0;
    return kAmplitude * glm::dvec3(along.y * along.y, along.z * along.z, along.x * along.x);
  }

  /// Coefficients c(q) = q^2 - 1/3 at control points q make x^2 of x, both counted in control points: the weights of
  /// a cubic B-spline have variance 1/3.
  Spline::Pointer transform() const {
    const auto spline = Spline::New();
    Spline::OriginType origin;
    Spline::PhysicalDimensionsType dimensions;
    Spline::MeshSizeType mesh;
    for (unsigned axis = 0; axis < 3; ++axis) {
      origin[axis] = low[static_cast<int>(axis)];
      dimensions[axis] = length[static_cast<int>(axis)];
      mesh[axis] = static_cast<itk::SizeValueType>(cells[static_cast<int>(axis)]);
    }
    spline->SetTransformDomainOrigin(origin);
    spline->SetTransformDomainPhysicalDimensions(dimensions);
    spline->SetTransformDomainMeshSize(mesh);
    auto coefficients = spline->GetCoefficientImages();
    for (unsigned component = 0; component < 3; ++component) {
      const unsigned axis = (component + 1) % 3;
      const double half = 0.5 * static_cast<double>(cells[static_cast<int>(axis)]);  // control points
      auto& image = *coefficients[component];
      itk::ImageRegionIteratorWithIndex<Spline::ImageType> each(&image, image.GetLargestPossibleRegion());
      for (; !each.IsAtEnd(); ++each) {
        const double q = static_cast<double>(each.GetIndex()[axis]) - 1 - half;  // the first lies before the domain
        each.Set(kAmplitude * (q * q - 1.0 / 3) / (half * half));
      }
    }
    spline->SetCoefficientImages(coefficients);
    return spline;
  }

 private:
  static constexpr double kAmplitude = 8;
};

ItkWork make_itk_transform(const SquareSpline& spline) {
  const auto filter = ToDisplacementField::New();
  const auto grid = ItkField::New();
  set_geometry(*grid, spline.lattice);
  filter->SetTransform(spline.transform());
  filter->SetReferenceImage(grid);
  filter->UseReferenceImageOn();
  return image_work<ItkField>(Filters{filter.GetPointer()}, 0, [=](const ItkField& found) {
    return compare_displacements(vectors_of(found), spline, spline.lattice);
  });
}

ItkWork make_transform(const SquareSpline& spline, ItkImage* volume, std::int64_t cell_size) {
  const auto filter = ToVertexField::New();
  filter->SetTransform(spline.transform());
  filter->SetReferenceImage(volume);
  filter->SetCellSize(static_cast<itk::SizeValueType>(cell_size));
  const auto found = [filter] {
    const FieldView field = filter->GetOutput()->GetView();
    return std::span(field.displacement, static_cast<std::size_t>(voxel_count(*field.lattice)));
  };
  return {[filter] { filter->Update(); }, 0, [=] { return found().size_bytes(); },
          [=] { return compare_displacements(found(), spline, filter->GetOutput()->GetLattice()); }};
}

}  // namespace

ItkWork make_itk_field_work(const ItkRequest& request, const ItkFiles& files) {
  const std::string& method = request.method;
  if (method == "invert" || method == "itk-invert" || method == "itk-invert-free") return make_inverse(request, files);
  if (method == "determinant") return make_determinant(request, files);
  if (method == "itk-determinant") return make_itk_determinant(request, files);
  if (method != "transform" && method != "itk-transform") return {};
  const auto reader = itk_reader<ItkImage>(files.volume());
  reader->UpdateOutputInformation();  // the grid alone
  const ItkImage::Pointer volume = reader->GetOutput();
  const SquareSpline spline(geometry_of(*volume), request.cell_size);
  if (method == "itk-transform") return make_itk_transform(spline);
  return make_transform(spline, volume, request.cell_size);
}

ItkWork make_itk_work(const ItkRequest& request, const ItkFiles& files) {
  const auto threads = static_cast<itk::ThreadIdType>(request.threads);
  itk::MultiThreaderBase::SetGlobalMaximumNumberOfThreads(threads);
  itk::MultiThreaderBase::SetGlobalDefaultNumberOfThreads(threads);
  ItkWork work = make_itk_image_work(request, files);
  if (!work.run) work = make_itk_field_work(request, files);
  require(work.run != nullptr, "no method \"" + request.method + "\"");
  return work;
}

}  // namespace tetwarp::bench
