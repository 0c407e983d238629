// Cylinders at boxes and at each other (closed_overlap.cpp).
#include <cmath>

#include "server/collision/overlap_search.h"
#include "server/collision/rim_pair.h"

namespace cradle {
namespace {

/// Rims are followed down if they overlap by no more than this many times what others do.
constexpr double kPromising = 6;
/// So are those beside a cap.
constexpr double kDeepShare = 2;
/// What touches along one direction may be apart along that of a rim which is nearest.
constexpr double kTouching_m = 1e-12;

}  // namespace

/// The side of the cylinder at a corner of the box, which is farthest along `toward`.
void OverlapSearch::try_corners(Vector toward) {
  // Where edges lie behind each other another corner may be nearer; then it is the next.
  Vector last = Vector::Zero();
  for (int step = 0; step < 3; ++step) {
    Vector corner;
    for (int k = 0; k < 3; ++k) corner[k] = std::copysign(P_.size[k], toward[k]);
    if (corner == last) return;
    last = corner;
    const Vector d = c_ - corner, across = d - b_ * b_.dot(d);
    const double length = across.norm();
    if (!(length > 0)) return;
    attempt(across / length, OverlapTouch::on_P);
    toward = across;
  }
}

/// The side of the cylinder beside the box's edges, and then beside the corners of the nearest one.
/// `edge`: that of the best direction, if it is such a one.
void OverlapSearch::try_edges_and_corners(int& edge) {
  const Vector& h = P_.size;
  const double r = Q_.size.x();
  int nearest = -1;
  double least = std::numeric_limits<double>::infinity();
  Vector toward_edge = Vector::Zero();
  for (int k = 0; k < 3; ++k) {
    const Vector across = Vector::Unit(k).cross(b_);
    const double length2 = across.squaredNorm();
    if (!(length2 > kParallel2)) continue;
    const double length = std::sqrt(length2), along = across.dot(c_);
    const double overlap = r + (box_reach(across) - std::abs(along)) / length;
    if (overlap < least) {
      least = overlap;
      nearest = k;
      toward_edge = along < 0 ? Vector(-across) : across;
    }
    if (!(overlap < best_.overlap)) continue;
    edge = k;
    take(across / length, overlap, along < 0, OverlapTouch::lines);
  }
  if (least < r) {  // the axis passes the box beside it
    Vector toward = toward_edge, middle;
    for (int k = 0; k < 3; ++k) middle[k] = k == nearest ? 0 : std::copysign(h[k], toward[k]);
    const Vector edge_across = Vector::Unit(nearest) - b_ * b_[nearest];
    const double along = (c_ - middle).dot(edge_across);
    toward[nearest] = along;
    if (std::abs(along) > h[nearest] * edge_across.squaredNorm()) try_corners(toward);
  }
}

std::optional<LeastOverlap> OverlapSearch::box_cylinder() {
  const Vector& h = P_.size;
  const double r = Q_.size.x(), H = Q_.size.y();
  const Cylinder cylinder{b_, r, H};
  const Vector squares = b_.cwiseProduct(b_);
  for (int k = 0; k < 3; ++k) {
    const double across = std::sqrt(squares[(k + 1) % 3] + squares[(k + 2) % 3]);
    take(Vector::Unit(k), h[k] + r * across + H * std::abs(b_[k]) - std::abs(c_[k]), c_[k] < 0,
         OverlapTouch::on_Q);
    if (is_beyond_limit()) return beyond(best_.n, -best_.overlap);
  }
  const double height = b_.dot(c_);
  take(b_, box_reach(b_) + H - std::abs(height), height < 0, OverlapTouch::on_P);
  if (is_beyond_limit()) return beyond(best_.n, -best_.overlap);
  if (const auto found = at_face()) return found;

  int edge = -1;
  try_edges_and_corners(edge);
  if (is_beyond_limit()) return beyond(best_.n, -best_.overlap);
  for (int k = 0; k < 3; ++k) {
    try_rim_at_box(cylinder, h, k, c_, best_.overlap,
                   [&](const Vector& n) { attempt(n, OverlapTouch::on_Q); });
  }
  const Vector edge_P = edge < 0 ? Vector(Vector::Zero()) : Vector::Unit(edge);
  if (best_.overlap < kTouching_m) return closest_points(edge_P);
  return result(edge_P);
}

std::optional<LeastOverlap> OverlapSearch::cylinder_cylinder() {
  const Cylinder A{Vector::UnitZ(), P_.size.x(), P_.size.y()}, B{b_, Q_.size.x(), Q_.size.y()};
  const SeenAlong A_seen(A, b_), B_seen(B, A.axis);
  const double cosine = std::abs(b_.z());
  const double sine = std::sqrt(b_.x() * b_.x() + b_.y() * b_.y());
  const double height = b_.dot(c_);
  take(A.axis, A.half_length + B.radius * sine + B.half_length * cosine - std::abs(c_.z()),
       c_.z() < 0, OverlapTouch::on_Q);
  take(b_, B.half_length + A.radius * sine + A.half_length * cosine - std::abs(height), height < 0,
       OverlapTouch::on_P);
  if (is_beyond_limit()) return beyond(best_.n, -best_.overlap);
  if (const auto found = at_face()) return found;
  if (!A_seen.is_round) {
    const double along = A_seen.u.dot(c_);
    take(A_seen.u, A.radius + B.radius - std::abs(along), along < 0, OverlapTouch::lines);
  } else {
    const double across = std::sqrt(c_.x() * c_.x() + c_.y() * c_.y());
    attempt(across > 0 ? Vector(c_.x() / across, c_.y() / across, 0) : Vector(Vector::UnitX()),
            OverlapTouch::on_P);
  }
  if (is_beyond_limit()) return beyond(best_.n, -best_.overlap);
  // A side adds its radius to what is seen along it.
  try_rim_at_line(A_seen, c_, best_.overlap - B.radius,
                  [&](const Vector& n) { attempt(n, OverlapTouch::on_P); });
  try_rim_at_line(B_seen, c_, best_.overlap - A.radius,
                  [&](const Vector& n) { attempt(n, OverlapTouch::on_Q); });
  if (!A_seen.is_round) try_rims(A, B, A_seen.u);
  if (best_.overlap < kTouching_m) return closest_points(A.axis);
  return result(A.axis);
}

void OverlapSearch::try_rims(const Cylinder& A, const Cylinder& B, const Vector& u) {
  bool is_rim = false;
  const Vector toward_B = toward_Q(u);
  const double cosine = A.axis.dot(B.axis), sine2 = 1 - cosine * cosine;
  const double c_A = c_.dot(A.axis), c_B = c_.dot(B.axis);
  for (const double of_A : {1.0, -1.0}) {
    for (const double of_B : {1.0, -1.0}) {
      // Each rim must reach the plane of the other.
      const double h_A = of_A * A.half_length, h_B = of_B * B.half_length;
      const double to_A = c_A - h_A + h_B * cosine, to_B = c_B - h_A * cosine + h_B;
      if (!(to_A * to_A < B.radius * B.radius * sine2)) continue;
      if (!(to_B * to_B < A.radius * A.radius * sine2)) continue;
      const RimPair rims(A, B, c_, of_A, of_B);
      Vector p_A, p_B;
      if (!rims.begin(toward_B, p_A, p_B)) continue;
      const Vector n = rims.normal(p_A, p_B);
      const double overlap = reach(n) - std::abs(n.dot(c_));
      if (!(overlap < kPromising * std::abs(best_.overlap))) continue;
      rims.polish(p_A, p_B);
      const double before = best_.overlap;
      attempt(rims.normal(p_A, p_B), OverlapTouch::on_P);
      is_rim = is_rim || best_.overlap < before;
    }
  }
  if (is_rim) return;
  const Direction best = best_;
  if (touch_ != OverlapTouch::lines) try_rim_beside(A, B, best.n, touch_ == OverlapTouch::on_Q);
  for (const bool is_A : {true, false}) {
    const Vector n = toward_Q(is_A ? A.axis : B.axis);
    if (!(reach(n) - n.dot(c_) < kDeepShare * std::abs(best.overlap))) continue;
    if (n != best.n) try_rim_beside(A, B, n, is_A);
  }
}

/// `n` is a direction of a cap or a side: if what touches it is beside it, its rim is nearer.
void OverlapSearch::try_rim_beside(const Cylinder& A, const Cylinder& B, const Vector& n,
                                   bool is_of_A) {
  const Cylinder &one = is_of_A ? A : B, &other = is_of_A ? B : A;
  // Of the other's rim, from both middles.
  const Vector p = is_of_A ? point_of_Q(n) : Vector(point_of_P(n) - c_);
  const Vector o = is_of_A ? Vector(p - c_) : Vector(p + c_);
  double height = p.dot(one.axis);
  Vector p_one = p - height * one.axis, p_other = o - o.dot(other.axis) * other.axis;
  if (std::abs(n.dot(one.axis)) > 0.5) {
    if (!(p_one.squaredNorm() > one.radius * one.radius)) return;
    height = is_of_A ? n.dot(one.axis) : -n.dot(one.axis);
  } else {
    if (!(std::abs(height) > one.half_length)) return;
    p_one = is_of_A ? n : Vector(-n);
  }
  if (!(p_other.squaredNorm() > 0)) return;
  p_one.normalize();
  p_other.normalize();
  const double of_one = height < 0 ? -1 : 1, of_other = o.dot(other.axis) < 0 ? -1 : 1;
  const RimPair rims(A, B, c_, is_of_A ? of_one : of_other, is_of_A ? of_other : of_one);
  Vector &p_A = is_of_A ? p_one : p_other, &p_B = is_of_A ? p_other : p_one;
  rims.polish(p_A, p_B);
  attempt(rims.normal(p_A, p_B), OverlapTouch::on_P);
}

}  // namespace cradle
