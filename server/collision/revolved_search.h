/// The search of revolved_pair.cpp: symbols and method there. Private to this folder.
#pragma once

#include <optional>

#include "server/collision/best_face.h"
#include "server/collision/revolved_body.h"
#include "server/collision/rim_patch.h"

namespace cradle {

inline constexpr double kAlong2 = 1e-30;  // squared sine: below, nothing is across both axes

/// What touches first when the two have been moved apart along the best direction.
enum class PairTouch { face_of_A, face_of_B, on_A, on_B, lines, rims };

/// Of one pair; it keeps the best direction so far.
class RevolvedPair {
 public:
  RevolvedPair(const ConvexPair& pair, double limit, double lead_wanted)
      : pair_(pair),
        limit_(limit),
        lead_wanted_(lead_wanted),
        A_(pair.A, Vector::UnitZ(), Vector::Zero()),
        B_(pair.B, pair.R.col(2), pair.t),
        below_A_(A_, pair.A.centre + pair.centre, pair.B.inner_radius),
        below_B_(B_, pair.A.centre, pair.A.inner_radius),
        cosine_(B_.axis.z()) {
    const double sine2 = B_.axis.x() * B_.axis.x() + B_.axis.y() * B_.axis.y();
    Vector e = Vector::UnitX();
    if (sine2 > kAlong2) {
      sine_ = std::sqrt(sine2);
      e = Vector(-B_.axis.y(), B_.axis.x(), 0) / sine_;
    } else {
      const double length = std::sqrt(pair.t.x() * pair.t.x() + pair.t.y() * pair.t.y());
      if (length > 0) e = Vector(pair.t.x(), pair.t.y(), 0) / length;
    }
    u_A_ = Vector(e.y(), -e.x(), 0);
    u_B_ = B_.axis.cross(e);
    e_ = e.dot(pair.t) < 0 ? Vector(-e) : e;
    t_e_ = e_.dot(pair.t);
  }

  std::optional<LeastOverlap> find();

 private:
  /// One of the bodies beside the other. Directions m are out of the one: n, or -n.
  struct View {
    const RevolvedBody &one, &other;
    const PartBounds &below_one, &below_other;
    const Vector& u;
    double sign;      ///< of n in m
    double d_a, d_u;  ///< m, from the one's middle to the other's: along its axis, and u
  };

  /// A rim of each, with the frames in which their points are known: v and e.
  struct Rims {
    Vector v_A, v_B;
    RimPatch patch;
  };

  /// A part of each body: the direction of the point that touches, and whether its rim would be the
  /// upper one.
  struct Beside {
    Vector p_A, p_B;
    bool upper_A = false, upper_B = false;
  };

  double overlap(const Vector& n) const {
    return A_.reach_along(n.z(), std::sqrt(n.x() * n.x() + n.y() * n.y())) + B_.reach_along(-n) -
           n.dot(pair_.t);
  }
  bool take(const Vector& n, double overlap, PairTouch touch) {
    if (!(overlap < best_.overlap)) return false;
    best_.n = n;
    best_.overlap = overlap;
    touch_ = touch;
    return true;
  }
  bool attempt(const Vector& n, PairTouch touch) { return take(n, overlap(n), touch); }
  bool is_beyond_limit() const { return -best_.overlap > limit_; }

  void try_caps();
  std::optional<LeastOverlap> at_face();
  void try_sides();
  void try_side(const View& view);
  void try_side_at(const View& view, bool of_upper, double low, double high);
  Vector normal_at(const View& view, const HalfAngle& at) const {
    return view.sign * (view.one.up * view.one.axis + view.one.out * at.c * view.u) +
           view.one.out * at.s * e_;
  }

  // revolved_rims.cpp
  void try_rims();
  void try_rims(bool upper_A, bool upper_B);
  Rims rims(bool upper_A, bool upper_B, double most) const;
  bool try_rims_from(const Rims& both, HalfAngle at_A, HalfAngle at_B);
  bool is_minimum();
  bool is_opposite(Beside& beside) const;
  bool is_opposite(const RevolvedBody& one, const RevolvedBody& other, const Vector& m,
                   Vector& p_one, bool& upper_one, Vector& p_other, bool& upper_other) const;
  bool try_rims_beside(const Beside& beside);

  bool is_at_face() const {
    return touch_ == PairTouch::face_of_A || touch_ == PairTouch::face_of_B;
  }
  void cross_lines(double& on_A, double& on_B) const;
  static Vector deepest_in(const RevolvedBody& one, const RevolvedBody& other, const Vector& m);
  LeastOverlap result() const;
  std::optional<LeastOverlap> closest_points();
  std::optional<LeastOverlap> closest_points_from(Vector p);

  const ConvexPair& pair_;
  const double limit_, lead_wanted_;
  const RevolvedBody A_, B_;
  const PartBounds below_A_, below_B_;
  const double cosine_;
  double sine_ = 0;
  Vector e_, u_A_, u_B_;  ///< unit: across both axes, toward B; across each in their plane
  double t_e_;            ///< m, along e: from A to B, not negative
  Direction best_;
  PairTouch touch_ = PairTouch::on_A;
};

}  // namespace cradle
