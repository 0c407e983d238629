// Separating axes of two boxes: Gottschalk, Lin, Manocha, OBBTree, SIGGRAPH 1996, section 5.
// Everything in the world frame; u points from A to B. Other shapes: parting.cpp.
#include "tests/bench/penetration.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/bench/parting.h"

namespace cradle::bench {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Squared sine between two edges below which their cross product has no direction of its own; the
// faces' axes then see all there is.
constexpr double kParallel = 1e-20;

/// Half the length of a box's shadow on a unit axis.
double shadow(const Vector& half, const Matrix& R, const Vector& axis) {
  return half.dot((R.transpose() * axis).cwiseAbs());
}

double overlap_of_boxes(const Vector& a, const Pose& A, const Vector& b, const Pose& B) {
  const Vector u = B.x - A.x;
  double least = kInfinity;
  const auto apart_along = [&](const Vector& axis) {
    least = std::min(least, shadow(a, A.R, axis) + shadow(b, B.R, axis) - std::abs(u.dot(axis)));
    return least < 0;
  };
  for (int i = 0; i < 3; ++i) {
    if (apart_along(A.R.col(i)) || apart_along(B.R.col(i))) return least;
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Vector axis = A.R.col(i).cross(B.R.col(j));
      const double squared = axis.squaredNorm();
      if (squared > kParallel && apart_along(axis / std::sqrt(squared))) return least;
    }
  }
  return least;
}

double overlap_of_sphere_and_box(const Vector& centre_W, double radius, const Vector& half,
                                 const Pose& B) {
  const Vector p = B.R.transpose() * (centre_W - B.x);
  const Vector beyond = p.cwiseAbs() - half;  // negative: within that pair of faces
  const double depth = beyond.maxCoeff();
  return depth <= 0 ? radius - depth : radius - beyond.cwiseMax(0).norm();
}

/// Shapes whose overlap is measured; the others touch nothing here.
bool is_known(ShapeKind kind) { return kind > ShapeKind::none && kind <= ShapeKind::hull; }

double bounding_radius(const Solid& solid) {
  const Shape& shape = solid.shape;
  switch (shape.kind) {
    case ShapeKind::sphere:
      return shape.radius_m();
    case ShapeKind::box:
      return to_eigen(shape.half_extents_m()).norm();
    case ShapeKind::capsule:
      return shape.radius_m() + shape.half_length_m();
    case ShapeKind::cylinder:
    case ShapeKind::cone:
      return std::hypot(shape.radius_m(), shape.half_length_m());
    case ShapeKind::ellipsoid:
      return to_eigen(shape.half_extents_m()).maxCoeff();
    case ShapeKind::hull: {
      double most = 0;
      for (const Vector& v : solid.hull().vertices) most = std::max(most, v.norm());
      return most;
    }
    default:
      return kInfinity;
  }
}

/// 21 bits a coordinate: cells that far apart may share a number, which costs time, not pairs.
std::uint64_t cell_number(const Eigen::Matrix<std::int64_t, 3, 1>& c) {
  constexpr std::uint64_t mask = (1U << 21) - 1;
  const auto bits = [](std::int64_t value) { return static_cast<std::uint64_t>(value) & mask; };
  return bits(c.x()) << 42 | bits(c.y()) << 21 | bits(c.z());
}

bool is_finite(const BodyState& s) {
  return to_eigen(s.p_WBo).allFinite() && to_eigen(s.q_WB).coeffs().allFinite();
}

}  // namespace

double overlap_m(const Solid& A, const Pose& X_WA, const Solid& B, const Pose& X_WB) {
  using enum ShapeKind;
  const Shape &a = A.shape, &b = B.shape;
  if (!is_known(a.kind) || !is_known(b.kind)) return -kInfinity;
  if (a.kind > b.kind) return overlap_m(B, X_WB, A, X_WA);
  if (a.kind == half_space && b.kind == half_space) return -kInfinity;
  if (a.kind == box && b.kind == box) {
    return overlap_of_boxes(to_eigen(a.half_extents_m()), X_WA, to_eigen(b.half_extents_m()), X_WB);
  }
  if (a.kind == sphere && b.kind == box) {
    return overlap_of_sphere_and_box(X_WA.x, a.radius_m(), to_eigen(b.half_extents_m()), X_WB);
  }
  if (a.kind == sphere && b.kind == sphere) {
    return a.radius_m() + b.radius_m() - (X_WB.x - X_WA.x).norm();
  }
  const Pair pair{A, B, X_WA, X_WB};
  const Vector between = X_WB.x - X_WA.x;
  if (!pair.has(half_space) && between.norm() > 0) {
    const double along_centres = overlap(pair, between.normalized());
    if (along_centres < 0) return along_centres;
  }
  return parting(pair).overlap;
}

PenetrationCheck::PenetrationCheck(const Scene& scene) {
  double largest_dynamic = 0;
  for (const BodySpec& body : scene.bodies) {
    is_dynamic_.push_back(body.kind == BodyKind::dynamic);
    parts_.push_back(convex_parts(scene, body.shape));
    double radius = 0;
    for (const Part& part : parts_.back()) {
      radius = std::max(radius, part.X_BP.x.norm() + bounding_radius(part.solid));
    }
    radii_.push_back(radius);
    if (is_dynamic_.back()) largest_dynamic = std::max(largest_dynamic, radius);
  }
  cell_m_ = 2 * largest_dynamic;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (parts_[i].empty()) continue;
    (radii_[i] <= largest_dynamic ? small_ : large_).push_back(i);
  }
  poses_.resize(parts_.size());
}

std::vector<PenetrationCheck::Part> PenetrationCheck::convex_parts(const Scene& scene,
                                                                   const Shape& shape) {
  std::vector<Part> parts;
  if (!is_stored(shape.kind)) {
    if (is_known(shape.kind)) parts.push_back({shape, {}});
    return parts;
  }
  const GeometryPointer& geometry =
      scene.geometries.at(static_cast<std::size_t>(shape.parameters[0]) - 1);
  if (shape.kind == ShapeKind::hull) parts.push_back({Solid(geometry), {}});
  if (shape.kind == ShapeKind::compound) {
    for (const CompoundPart& part : std::get<Compound>(geometry->value).parts) {
      if (!is_known(part.shape.kind)) continue;
      const Solid solid = part.geometry ? Solid(part.geometry) : Solid(part.shape);
      parts.push_back({solid, {part.p_BoPo, part.q_BP.toRotationMatrix()}});
    }
  }
  return parts;
}

double PenetrationCheck::depth_m(std::size_t i, std::size_t j) const {
  const auto posed = [](const Pose& X, const Pose& in) {
    return Pose{X.x + X.R * in.x, X.R * in.R};
  };
  double most = -kInfinity;
  for (const Part& a : parts_[i]) {
    for (const Part& b : parts_[j]) {
      most = std::max(
          most, overlap_m(a.solid, posed(poses_[i], a.X_BP), b.solid, posed(poses_[j], b.X_BP)));
    }
  }
  return most;
}

Penetration PenetrationCheck::look(std::span<const BodyState> states) {
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (!is_finite(states[i])) {
      constexpr double nan = std::numeric_limits<double>::quiet_NaN();
      return {nan, nan, 0, nan};
    }
    poses_[i] = {to_eigen(states[i].p_WBo), to_eigen(states[i].q_WB).toRotationMatrix()};
  }
  Penetration found;
  double sum = 0;
  for_near_pairs([&](std::size_t i, std::size_t j) {
    if (!is_dynamic_[i] && !is_dynamic_[j]) return;
    const double depth = depth_m(i, j);
    if (depth <= 0) return;
    found.max_m = std::max(found.max_m, depth);
    sum += depth;
    found.squares_m2 += depth * depth;
    ++found.pairs;
  });
  if (found.pairs > 0) found.mean_m = sum / static_cast<double>(found.pairs);
  return found;
}

template <typename Visit>
void PenetrationCheck::for_near_pairs(Visit visit) {
  using Offset = Eigen::Matrix<std::int64_t, 3, 1>;
  for (const std::size_t i : small_) {
    for (const std::size_t j : large_) visit(i, j);
  }
  const auto cell_of = [&](std::size_t i) -> Offset {
    return (poses_[i].x / cell_m_).array().floor().matrix().cast<std::int64_t>();
  };
  grid_.clear();
  for (const std::size_t i : small_) grid_.emplace_back(cell_number(cell_of(i)), i);
  std::sort(grid_.begin(), grid_.end());

  // A cell is as wide as the widest pair that can touch, so the 27 cells around hold all partners.
  for (const std::size_t i : small_) {
    for (int k = 0; k < 27; ++k) {
      const Cell cell = cell_number(cell_of(i) + Offset{k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1});
      auto entry = std::lower_bound(grid_.begin(), grid_.end(), std::pair{cell, i + 1});
      for (; entry != grid_.end() && entry->first == cell; ++entry) {
        const std::size_t j = entry->second;
        if ((poses_[j].x - poses_[i].x).norm() <= radii_[i] + radii_[j]) visit(i, j);
      }
    }
  }
}

}  // namespace cradle::bench
