// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/phantom/painter.h"

namespace tetwarp::phantom {

namespace {

constexpr float kAir = -1000, kSkin = 10, kFat = -102, kMuscle = 52, kInsideFat = -92, kLung = -868, kPleura = 20,
                kFissure = -650;

/// How much of a voxel at signed distance `d` lies inside: 1 deep inside, 0 outside, smooth over `edge` mm.
float coverage(float d, float edge) {
  const float t = std::clamp(0.5f - d / edge, 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

/// How much of a voxel lies in the layer between two surfaces, given its signed distance from each: a voxel larger than
/// the layer has only a part of it.
float layer(float outer, float inner, float edge) {
  return std::max(coverage(outer, edge) - coverage(inner, edge), 0.0f);
}

/// HU of the lung. It is denser at the back, where a patient who lies on the back has the blood.
float lung_hu(Point p) { return kLung + 0.35f * (p.y + 20); }

/// Distance to the nearest fissure: the oblique one of either lung, and the level one of the right lung in front of it.
float fissure(Point p) {
  const float oblique = (p.z - 8 - 1.05f * p.y - 0.0016f * p.x * p.x) * 0.69f;
  const float level = p.x < 0 && oblique > 0 ? std::abs(p.z - 14 + 0.0012f * p.y * p.y) : 1000.0f;
  return std::min(std::abs(oblique), level);
}

void paint_inside(const PaintedRow& row, const Trunk& trunk, std::size_t i, const Walls& walls) {
  const Point p = row.points[i];
  const float edge = row.edge;
  // Thickness, 0 to 1, of the fat under the broad muscles of the flank.
  const float beside = std::max(1 - p.y * p.y * 2.2e-4f, 0.0f);
  if (p.z > -130 && p.z < 132)
    row.blend(i, kFat + 20, layer(walls.cage - 10 - 3 * beside, walls.cage - 10, edge), PhantomLabel::body);
  if (walls.cage < 12) {
    const Trunk::Rib rib = trunk.rib(p, walls);
    const PhantomLabel label = rib.cartilage ? PhantomLabel::body : PhantomLabel::bone;
    row.blend(i, rib.cartilage ? 105.0f : 850.0f, std::min(1.0f, 5 / edge) * coverage(rib.distance, edge), label);
    if (!rib.cartilage) row.blend(i, 230, std::min(1.0f, 3 / edge) * coverage(rib.distance + 1.3f, edge), label);
  }
  if (walls.cage > edge) return;
  row.blend(i, kInsideFat, coverage(walls.cage, edge), PhantomLabel::body);
  if (walls.diaphragm > -6) {
    const float lungs = trunk.lungs(p, walls);
    row.blend(i, kPleura, layer(lungs - 1.2f, lungs, edge), PhantomLabel::body);
    row.blend(i, lung_hu(p), coverage(lungs, edge), PhantomLabel::lung);
    row.blend(i, kFissure, std::min(1.0f, 1.2f / edge) * coverage(std::max(lungs + 1, fissure(p) - 0.6f), edge),
              PhantomLabel::lung);
  }
  row.blend(i, kMuscle, coverage(walls.cage + 1, edge) * layer(walls.diaphragm - 1.5f, walls.diaphragm + 1.5f, edge),
            PhantomLabel::body);
}

template <class S>
void paint_shape(const PaintedRow& row, const S& shape, const Organ& organ, const Bounds& reach, const Trunk& trunk) {
  const float share = std::min(1.0f, (shape.thickness() + 2 * organ.grow) / row.edge), half_edge = 0.5f * row.edge;
  if (share <= 0) return;
  const auto begin = row.points.begin(), end = row.points.end();
  const auto first = std::partition_point(begin, end, [&](const Point& p) { return p.x < reach.low.x; });
  for (auto i = static_cast<std::size_t>(first - begin); i < row.points.size(); ++i) {
    const Point p = row.points[i];
    if (p.x > reach.high.x) break;
    float d = shape.distance(p) - organ.grow;
    if (d >= half_edge) continue;
    if (organ.within == Within::chest) d = std::max(d, 2 - diaphragm(p));
    if (organ.within == Within::abdomen) d = std::max({d, diaphragm(p) + 1.3f, trunk.walls(p).cage + 1.5f});
    if (organ.level_y != kNoLevel) d = std::max(d, row.straight_y - organ.level_y);
    row.blend(i, organ.hu, share * coverage(d, row.edge), organ.label);
  }
}

}  // namespace

Bounds reach(const Organ& organ, float edge) {
  Bounds box = std::visit([](const auto& shape) { return shape.bounds(); }, organ.shape);
  const float more = std::max(organ.grow, 0.0f) + edge;
  return {box.low - more, box.high + more};
}

void paint_surroundings(const PaintedRow& row) {
  // The table: its top is curved, hull and foam lie between two arcs about a line far above.
  constexpr float kRadius = 520, kTop = 117, kHalfThickness = 15, kHalfWidth = 196, kHull = 2.2f;
  std::fill(row.hu.begin(), row.hu.end(), kAir);
  std::fill(row.label.begin(), row.label.end(), PhantomLabel::nothing);
  if (row.straight_y < kTop - 60) return;
  for (std::size_t i = 0; i < row.hu.size(); ++i) {
    const float x = row.straight_x[i], y = row.straight_y - (kTop - kRadius);
    const float across = std::abs(std::sqrt(x * x + y * y) - kRadius - kHalfThickness) - kHalfThickness;
    const float d = std::max(across, std::abs(x) - kHalfWidth);
    row.blend(i, -180, std::min(1.0f, 2 * kHull / row.edge) * coverage(d, row.edge), PhantomLabel::nothing);
    row.blend(i, -955, coverage(d + kHull, row.edge), PhantomLabel::nothing);
  }
}

void paint_trunk(const PaintedRow& row, const Trunk& trunk) {
  constexpr float kWidest = 182, kFront = -124, kBack = 116;  // mm: the skin is nowhere further out
  if (row.box.high.y < kFront - row.edge || row.box.low.y > kBack + row.edge) return;
  for (std::size_t i = 0; i < row.points.size(); ++i) {
    const Point p = row.points[i];
    if (std::abs(p.x) > kWidest + row.edge) continue;
    const Walls walls = trunk.walls(p);
    if (walls.skin > row.edge) continue;
    row.blend(i, kSkin, coverage(walls.skin, row.edge), PhantomLabel::body);
    row.blend(i, kFat, coverage(walls.skin + 2, row.edge), PhantomLabel::body);
    row.blend(i, kMuscle, coverage(walls.muscle, row.edge), PhantomLabel::body);
    if (walls.muscle < row.edge) paint_inside(row, trunk, i, walls);
  }
}

void paint_organ(const PaintedRow& row, const Organ& organ, const Trunk& trunk) {
  const Bounds box = reach(organ, row.edge);
  if (!overlap(box, row.box)) return;
  std::visit([&](const auto& shape) { paint_shape(row, shape, organ, box, trunk); }, organ.shape);
}

}  // namespace tetwarp::phantom
