/// The search of closed_overlap.cpp: symbols and method there. Private to this folder.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "server/collision/best_face.h"
#include "server/collision/rim.h"

namespace cradle {

inline constexpr double kParallel2 = 1e-30;  // squared sine: below, edges have no common normal

/// What touches first when the two have been moved apart along the best direction.
enum class OverlapTouch { on_P, on_Q, lines };

/// Of one pair; it keeps the best direction so far.
class OverlapSearch {
 public:
  OverlapSearch(const ConvexPair& pair, double limit, double lead_wanted)
      : pair_(pair),
        limit_(limit),
        lead_wanted_(lead_wanted),
        is_swapped_(pair.B.kind == ShapeKind::box || pair.A.kind == ShapeKind::capsule),
        P_(is_swapped_ ? pair.B : pair.A),
        Q_(is_swapped_ ? pair.A : pair.B),
        c_(is_swapped_ ? Vector(-(pair.R.transpose() * pair.t)) : pair.t),
        b_(is_swapped_ ? Vector(pair.R.row(2)) : Vector(pair.R.col(2))) {}

  std::optional<LeastOverlap> find() {
    const bool is_box = P_.kind == ShapeKind::box, is_segment = Q_.kind == ShapeKind::capsule;
    if (is_box) return is_segment ? box_segment() : box_cylinder();
    return is_segment ? cylinder_segment() : cylinder_cylinder();
  }

 private:
  // segment_overlap.cpp
  LeastOverlap box_segment();
  LeastOverlap cylinder_segment();

  // cylinder_overlap.cpp
  std::optional<LeastOverlap> box_cylinder();
  std::optional<LeastOverlap> cylinder_cylinder();
  void try_edges_and_corners(int& edge);
  void try_corners(Vector toward);
  void try_rims(const Cylinder& A, const Cylinder& B, const Vector& u);
  void try_rim_beside(const Cylinder& A, const Cylinder& B, const Vector& n, bool is_of_A);

  // How far each reaches along n from its middle.
  double box_reach(const Vector& n) const { return P_.size.dot(n.cwiseAbs()); }
  double upright_reach(const Vector& n) const {  // of a cylinder P
    return P_.size.x() * std::sqrt(n.x() * n.x() + n.y() * n.y()) + P_.size.y() * std::abs(n.z());
  }
  double segment_reach(const Vector& n) const { return Q_.size.y() * std::abs(n.dot(b_)); }
  double cylinder_reach(const Vector& n) const {
    return Q_.size.x() * n.cross(b_).norm() + Q_.size.y() * std::abs(n.dot(b_));
  }
  double reach(const Vector& n) const {
    return (P_.kind == ShapeKind::box ? box_reach(n) : upright_reach(n)) +
           (Q_.kind == ShapeKind::capsule ? segment_reach(n) : cylinder_reach(n));
  }

  /// Takes a direction if it overlaps less, turned to where Q is. `n` is a unit vector, or zero
  /// where there is no direction.
  void attempt(const Vector& n, OverlapTouch touch) {
    const double along = n.dot(c_);
    if (n.isZero(0)) return;
    take(n, reach(n) - std::abs(along), along < 0, touch);
  }
  void take(const Vector& n, double overlap, bool is_opposite, OverlapTouch touch) {
    if (!(overlap < best_.overlap)) return;
    best_.overlap = overlap;
    best_.n = is_opposite ? Vector(-n) : n;
    touch_ = touch;
  }
  Vector toward_Q(const Vector& n) const { return n.dot(c_) < 0 ? Vector(-n) : n; }
  bool is_beyond_limit() const { return -best_.overlap > limit_; }

  LeastOverlap beyond(const Vector& n, double distance) const {
    return as_A_sees(LeastOverlap::beyond(n, distance));
  }

  Vector point_of_P(const Vector& n) const {
    std::int32_t none = 0;
    return P_.support(n, none);
  }
  Vector point_of_Q(const Vector& n) const {
    std::int32_t none = 0;
    if (!is_swapped_) return c_ + pair_.R * Q_.support(-(pair_.R.transpose() * n), none);
    return c_ + pair_.R.transpose() * Q_.support(-(pair_.R * n), none);
  }

  /// The best direction so far as A sees it. `edge` is P's where two lines touch.
  LeastOverlap result(const Vector& edge = Vector::Zero()) const;
  /// The point of P nearest to p, and of Q.
  Vector nearest_of_P(const Vector& p) const {
    if (P_.kind == ShapeKind::box) return p.cwiseMax(-P_.size).cwiseMin(P_.size);
    return nearest_of_cylinder(Vector::UnitZ(), P_.size, p);
  }
  Vector nearest_of_Q(const Vector& p) const {
    return c_ + nearest_of_cylinder(b_, Q_.size, p - c_);
  }
  static Vector nearest_of_cylinder(const Vector& axis, const Vector& size, const Vector& p) {
    const double height = p.dot(axis);
    const Vector across = p - height * axis;
    const double length = across.norm();
    const double inward = length > size.x() ? size.x() / length : 1;
    return inward * across + std::clamp(height, -size.y(), size.y()) * axis;
  }

  LeastOverlap as_A_sees(LeastOverlap found) const;

  /// The best direction so far, if it is that of a face and certainly the best of all.
  std::optional<LeastOverlap> at_face() const;
  /// Of cores that are apart, and whose best direction has been found but for corners and rims that
  /// are nearest; `edge` as above. Nothing if rounding gets in the way.
  std::optional<LeastOverlap> closest_points(const Vector& edge);

  const ConvexPair& pair_;
  const double limit_, lead_wanted_;
  const bool is_swapped_;
  const ConvexShape &P_, &Q_;
  const Vector c_, b_;
  Direction best_;
  OverlapTouch touch_ = OverlapTouch::on_P;
};

}  // namespace cradle
