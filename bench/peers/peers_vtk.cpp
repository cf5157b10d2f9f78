// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkProbeFilter.h>
#include <vtkShortArray.h>
#include <vtkSmartPointer.h>
#include <vtkStructuredGrid.h>
#include <vtkVersion.h>

#include "bench/peers/peers.h"
#include "bench/peers/vtk_threads.h"

namespace tetwarp::bench {

namespace {

static_assert(sizeof(short) == sizeof(std::int16_t));

constexpr const char* kValues = "values";

vtkNew<vtkPoints> deformed_points(const VertexField& field) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToFloat();
  points->SetNumberOfPoints(static_cast<vtkIdType>(field.displacement.size()));
  const glm::i64vec3 size = field.lattice.size;
  vtkIdType n = 0;
  for (std::int64_t k = 0; k < size.z; ++k) {
    for (std::int64_t j = 0; j < size.y; ++j) {
      for (std::int64_t i = 0; i < size.x; ++i, ++n) {
        const glm::vec3 place = glm::vec3(i, j, k) + field.displacement[static_cast<std::size_t>(n)];
        points->SetPoint(n, place.x, place.y, place.z);
      }
    }
  }
  return points;
}

}  // namespace

std::optional<std::string> vtk_version() {
  return std::string(vtkVersion::GetVTKVersion()) + ", threads by " + vtk_threads_backend();
}

Peer make_vtk_probe(const PeerInput& input, const VertexField& field) {
  set_vtk_threads(input.threads);
  const glm::ivec3 size(input.volume.geometry.size);
  vtkNew<vtkShortArray> values;
  values->SetName(kValues);
  values->SetArray(const_cast<short*>(input.volume.voxels.data()), static_cast<vtkIdType>(input.volume.voxels.size()),
                   /*save=*/1);
  vtkNew<vtkStructuredGrid> grid;
  grid->SetDimensions(size.x, size.y, size.z);
  grid->SetPoints(deformed_points(field));
  grid->GetPointData()->SetScalars(values);
  vtkNew<vtkImageData> centres;
  centres->SetDimensions(size.x, size.y, size.z);
  const vtkSmartPointer<vtkProbeFilter> probe = vtkSmartPointer<vtkProbeFilter>::New();
  probe->SetInputData(centres);
  probe->SetSourceData(grid);
  return [=]() -> std::span<const std::int16_t> {
    probe->Modified();
    probe->Update();
    auto* found = vtkShortArray::SafeDownCast(probe->GetOutput()->GetPointData()->GetArray(kValues));
    if (!found) throw Error("vtkProbeFilter made no int16 values");
    return {found->GetPointer(0), static_cast<std::size_t>(found->GetNumberOfTuples())};
  };
}

}  // namespace tetwarp::bench
