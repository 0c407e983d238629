// Separating axes of two boxes: Gottschalk, Lin, Manocha, OBBTree, SIGGRAPH 1996, section 5.
// Everything in the world frame; u points from A to B.
#include "tests/bench/penetration.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

/// Of a box or a sphere in the half-space `B`.
double overlap_with_half_space(const Shape& a, const Pose& A, const Pose& B) {
  const Vector normal = B.R.col(2);
  const double reach = a.kind == ShapeKind::sphere
                           ? a.radius_m()
                           : shadow(to_eigen(a.half_extents_m()), A.R, normal);
  return reach - normal.dot(A.x - B.x);
}

/// Shapes whose overlap is measured; the others touch nothing here.
bool is_known(ShapeKind kind) {
  return kind == ShapeKind::sphere || kind == ShapeKind::box || kind == ShapeKind::half_space;
}

double bounding_radius(const Shape& shape) {
  switch (shape.kind) {
    case ShapeKind::none:
      return 0;
    case ShapeKind::sphere:
      return shape.radius_m();
    case ShapeKind::box:
      return to_eigen(shape.half_extents_m()).norm();
    default:
      break;
  }
  return kInfinity;
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

double overlap_m(const Shape& a, const Pose& pose_A, const Shape& b, const Pose& pose_B) {
  using enum ShapeKind;
  if (!is_known(a.kind) || !is_known(b.kind)) return -kInfinity;
  if (a.kind > b.kind) return overlap_m(b, pose_B, a, pose_A);  // sphere, box, half-space
  if (b.kind == half_space) {
    return a.kind == half_space ? -kInfinity : overlap_with_half_space(a, pose_A, pose_B);
  }
  if (a.kind == box) {
    return overlap_of_boxes(to_eigen(a.half_extents_m()), pose_A, to_eigen(b.half_extents_m()),
                            pose_B);
  }
  if (b.kind == box) {
    return overlap_of_sphere_and_box(pose_A.x, a.radius_m(), to_eigen(b.half_extents_m()), pose_B);
  }
  return a.radius_m() + b.radius_m() - (pose_B.x - pose_A.x).norm();
}

PenetrationCheck::PenetrationCheck(const Scene& scene) : bodies_(scene.bodies) {
  double largest_dynamic = 0;
  for (const BodySpec& body : bodies_) {
    radii_.push_back(is_known(body.shape.kind) ? bounding_radius(body.shape) : 0);
    if (body.kind == BodyKind::dynamic) largest_dynamic = std::max(largest_dynamic, radii_.back());
  }
  cell_m_ = 2 * largest_dynamic;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (!is_known(bodies_[i].shape.kind)) continue;
    (radii_[i] <= largest_dynamic ? small_ : large_).push_back(i);
  }
  poses_.resize(bodies_.size());
}

Penetration PenetrationCheck::look(std::span<const BodyState> states) {
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (!is_finite(states[i])) {
      constexpr double nan = std::numeric_limits<double>::quiet_NaN();
      return {nan, nan, 0};
    }
    poses_[i] = {to_eigen(states[i].p_WBo), to_eigen(states[i].q_WB).toRotationMatrix()};
  }
  Penetration found;
  double sum = 0;
  for_near_pairs([&](std::size_t i, std::size_t j) {
    if (bodies_[i].kind != BodyKind::dynamic && bodies_[j].kind != BodyKind::dynamic) return;
    const double depth = overlap_m(bodies_[i].shape, poses_[i], bodies_[j].shape, poses_[j]);
    if (depth <= 0) return;
    found.max_m = std::max(found.max_m, depth);
    sum += depth;
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
