// Two convex polygons, lines or points over each other, as seen along z.
//
// Method: of two faces, one is the incident: each of its edges is clipped by the sides of the other
// (Liang and Barsky 1984, as in box_faces.cpp), then corners of the other inside it are added. So
// every corner of the common area appears once, named by what meets there. Heights are linear over
// both faces, so the separation is least at one of these corners, and exact there: the contact of
// two edges is where they cross, and needs no case of its own.
// Two lines touch where they cross; where they are nearly parallel, at the ends of what they have
// in common, too, less what round surfaces fall away to the side.
#include "server/collision/feature_overlap.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/collision/tolerances.h"

namespace cradle {
namespace {

constexpr int kMostCorners = SupportFeature::kCornersMax;
/// Sine of the angle between two lines up to which they are tried as parallel ones.
constexpr double kNearlyParallel = 0.1;
/// m. An end of an edge that is as near to a side as this is where the edge crosses it: closest
/// points put corners there but for rounding, which may not decide whether there are one or two.
constexpr double kAtSide_m = 1e-9;
/// m. Two ends that are no farther apart than the crossing but for this do without it.
constexpr double kAsDeep_m = 1e-9;

std::uint32_t name_corner(bool of_B, std::uint32_t corner) {
  return (of_B ? 2u : 1u) << 30 | corner;
}
std::uint32_t name_crossing(std::uint32_t edge_A, std::uint32_t edge_B) {
  return 3u << 30 | edge_A << 15 | edge_B;
}

double cross(double ax, double ay, double bx, double by) { return ax * by - ay * bx; }

/// A face as its sides bound it. Corners of a face that looks down run clockwise: `turn` is -1.
struct Sides {
  const SupportFeature& face;
  double turn;
  std::array<double, kMostCorners> x, y;  // the unit normal of each side, outward

  Sides(const SupportFeature& f, double direction) : face(f), turn(direction) {
    for (std::size_t k = 0; k < size(); ++k) {
      const Vector& p = face.corners[k];
      const Vector& q = face.corners[k + 1 < size() ? k + 1 : 0];
      const double ex = q.x() - p.x(), ey = q.y() - p.y();
      const double length = std::sqrt(ex * ex + ey * ey);
      const double scale = length > 0 ? turn / length : 0;
      x[k] = ey * scale;
      y[k] = -ex * scale;
    }
  }
  std::size_t size() const { return static_cast<std::size_t>(face.count); }
  double outside(std::size_t side, double px, double py) const {
    return x[side] * (px - face.corners[side].x()) + y[side] * (py - face.corners[side].y());
  }
  bool holds(double px, double py) const {
    for (std::size_t k = 0; k < size(); ++k) {
      if (!(outside(k, px, py) < 0)) return false;
    }
    return true;
  }
  double height(double px, double py) const {
    const Vector& n = face.normal;
    const Vector& o = face.corners[0];
    return o.z() - (n.x() * (px - o.x()) + n.y() * (py - o.y())) / n.z();
  }
};

/// A face with what lies over it.
class Clipper {
 public:
  Clipper(const Sides& reference, bool reference_is_A, const SupportFeature& incident, double slack,
          FeatureContacts& contacts)
      : sides_(reference),
        is_A_(reference_is_A),
        incident_(incident),
        slack_(slack),
        contacts_(contacts) {
    for (std::size_t i = 0; i < corners(); ++i) {
      for (std::size_t s = 0; s < sides_.size(); ++s) {
        outside_[i][s] = sides_.outside(s, incident.corners[i].x(), incident.corners[i].y());
      }
    }
  }

  void add_edges() {
    const bool is_line = corners() == 2;
    for (std::size_t k = 0; k < (is_line ? 1 : corners()); ++k) add_edge(k, is_line);
  }

  void add_corners_of_reference(const Sides& incident) {
    const Vector& n = incident_.normal;
    const double slope = n.head<2>().norm() / std::abs(n.z());
    for (std::size_t k = 0; k < sides_.size(); ++k) {
      const Vector& p = sides_.face.corners[k];
      if (!incident.holds(p.x(), p.y()) || contacts_.any_within(slack_, p.x(), p.y())) continue;
      add(p.x(), p.y(), p.z(), incident.height(p.x(), p.y()),
          name_corner(!is_A_, sides_.face.corner_names[k]));
      contacts_.steepness = std::max(contacts_.steepness, slope);
    }
  }

 private:
  std::size_t corners() const { return static_cast<std::size_t>(incident_.count); }

  void add(double x, double y, double z_reference, double z_incident, std::uint32_t name) {
    contacts_.add(x, y, is_A_ ? z_reference : z_incident, is_A_ ? z_incident : z_reference, name);
  }
  void add_incident(const Vector& p, std::uint32_t name) {
    add(p.x(), p.y(), sides_.height(p.x(), p.y()), p.z(), name);
  }

  /// Where the edge from corner `k` enters the face, and where it leaves it. Ends that are inside
  /// are added as corners: each by the edge that starts there, and the end of a line by itself.
  void add_edge(std::size_t k, bool is_line) {
    const std::size_t next = k + 1 < corners() ? k + 1 : 0;
    double enter = 0, leave = 1;
    std::size_t enter_side = 0, leave_side = 0;
    for (std::size_t s = 0; s < sides_.size(); ++s) {
      const double d0 = outside_[k][s], d1 = outside_[next][s];
      if (d0 > slack_ && d1 > slack_) return;
      if (d0 > slack_) {
        const double t = d1 > -kAtSide_m ? 1 : d0 / (d0 - d1);
        if (t > enter) enter = t, enter_side = s;
      } else if (d1 > slack_) {
        const double t = d0 > -kAtSide_m ? 0 : d0 / (d0 - d1);
        if (t < leave) leave = t, leave_side = s;
      }
    }
    const Vector& p = incident_.corners[k];
    const Vector& q = incident_.corners[next];
    const Vector first = p + (q - p) * enter, last = p + (q - p) * leave;
    const bool meets_first = (enter > 0 && enter_side == 0) || (leave < 1 && leave_side == 0);
    const auto crossing = [&](std::size_t side, const Vector& at) {
      const double across = std::abs(outside_[next][side] - outside_[k][side]);
      contacts_.steepness = std::max(contacts_.steepness, std::abs(q.z() - p.z()) / across);
      // The deepest point of a rim, over an edge, is where two sides of the octagon meet.
      const bool is_at_first =
          sides_.face.is_round && !meets_first &&
          (sides_.face.corners[0] - at).head<2>().norm() < kTolerances.witness_m;
      const std::uint32_t mine = incident_.edge_names[k],
                          other = sides_.face.edge_names[is_at_first ? 0 : side];
      return is_A_ ? name_crossing(other, mine) : name_crossing(mine, other);
    };
    const auto corner = [&](std::size_t i) {
      return name_corner(is_A_, incident_.corner_names[i]);
    };
    if (enter <= leave && (enter < 1 || is_line)) {
      const std::uint32_t name = enter > 0 ? crossing(enter_side, first) : corner(k);
      add_incident(first, is_line ? name_on_line(first, enter > 0, name) : name);
      if (is_line && (last - first).head<2>().norm() < kAtSide_m) return;
    }
    if (enter < leave && leave < 1) {
      const std::uint32_t name = crossing(leave_side, last);
      add_incident(last, is_line ? name_on_line(last, true, name) : name);
    }
    if (is_line && enter < 1 && leave >= 1) {
      add_incident(q, name_on_line(q, false, corner(next)));
    }
  }

  /// A line that only just reaches over the face meets two sides of it, or none, at their corner.
  std::uint32_t name_on_line(const Vector& p, bool is_crossing, std::uint32_t otherwise) const {
    const bool is_first = is_A_ != contacts_.B_names;
    if (sides_.face.is_round || !(is_crossing || is_first)) return otherwise;
    for (std::size_t k = 0; k < sides_.size(); ++k) {
      if ((sides_.face.corners[k] - p).head<2>().norm() < kAtSide_m) {
        return name_corner(!is_A_, sides_.face.corner_names[k]);
      }
    }
    return otherwise;
  }

  const Sides& sides_;
  const bool is_A_;
  const SupportFeature& incident_;
  const double slack_;
  FeatureContacts& contacts_;
  std::array<std::array<double, kMostCorners>, kMostCorners> outside_;
};

/// Of a disc in F.
Vector middle_of(const SupportFeature& disc) { return 0.5 * (disc.corners[0] + disc.corners[4]); }

/// Adds the ends of the part of a line that is over a disc: of the disc itself, not of its octagon.
void overlap_line_and_disc(const SupportFeature& line, const SupportFeature& disc, bool disc_is_A,
                           double slack, FeatureContacts& contacts) {
  const Vector &p = line.corners[0], &q = line.corners[1], &n = disc.normal;
  const Vector c = middle_of(disc);
  const double r = (disc.corners[0] - c).norm() + slack;
  const auto onto_disc = [&](const Vector& at) {  // along z
    return Vector(at.x(), at.y(), at.z() - n.dot(at - c) / n.z());
  };
  const Vector from = onto_disc(p) - c, way = onto_disc(q) - onto_disc(p);
  const double a = way.squaredNorm(), b = from.dot(way),
               root2 = b * b - a * (from.squaredNorm() - r * r);
  if (!(a > 0 && root2 >= 0)) return;
  const double root = std::sqrt(root2);
  const double enter = (-b - root) / a, leave = (-b + root) / a;
  if (!(enter <= 1 && leave >= 0)) return;
  const auto add = [&](double t, bool is_end, std::size_t end, std::size_t side) {
    const Vector at = p + t * (q - p), on = onto_disc(at);
    if (!is_end)
      contacts.steepness = std::max(contacts.steepness, std::abs(q.z() - p.z()) * r / root);
    const std::uint32_t mine = line.edge_names[0], rim = disc.edge_names[side];
    const std::uint32_t name = is_end      ? name_corner(disc_is_A, line.corner_names[end])
                               : disc_is_A ? name_crossing(rim, mine)
                                           : name_crossing(mine, rim);
    contacts.add(at.x(), at.y(), disc_is_A ? on.z() : at.z(), disc_is_A ? at.z() : on.z(), name);
  };
  add(std::max(enter, 0.0), enter <= 0, 0, 0);
  add(std::min(leave, 1.0), leave >= 1, 1, 4);
}

/// Of a face or line as seen along z, the point nearest to `c`: that itself if it is inside.
Vector nearest_of_polygon(const SupportFeature& feature, const Vector& c) {
  Vector nearest = feature.corners[0];
  double least = std::numeric_limits<double>::infinity();
  bool is_inside = feature.count > 2;
  const auto count = static_cast<std::size_t>(feature.count);
  for (std::size_t k = 0; k < count; ++k) {
    const Vector& p = feature.corners[k];
    const Vector& q = feature.corners[k + 1 < count ? k + 1 : 0];
    const Vector way = q - p, to_c = c - p;
    const double length2 = way.head<2>().squaredNorm();
    const double t = length2 > 0 ? within(0, to_c.head<2>().dot(way.head<2>()) / length2, 1) : 0;
    const double distance = (to_c - t * way).head<2>().norm();
    if (distance < least) least = distance, nearest = p + t * way;
    is_inside = is_inside && feature.normal.z() * cross(way.x(), way.y(), to_c.x(), to_c.y()) > 0;
  }
  return is_inside ? c : nearest;
}

Vector nearest_of(const SupportFeature& face, const Vector& p) {
  if (!face.is_round) return nearest_of_polygon(face, p);
  const Vector c = middle_of(face), d = p - c;
  const double r = (face.corners[0] - c).norm(), length = d.head<2>().norm();
  return length > r ? Vector(c + r / length * d) : p;
}

/// Turns the octagon of a level disc so that a corner is where the other feature is nearest to its
/// middle: else what just reaches over the rim might miss it.
void turn_to(SupportFeature& disc, const SupportFeature& other) {
  const Vector c = middle_of(disc), nearest = nearest_of_polygon(other, c);
  const Vector from = disc.corners[0] - c, to = nearest - c;
  const double lengths = from.head<2>().norm() * to.head<2>().norm();
  if (!(lengths > 0)) return;
  const double cosine = from.head<2>().dot(to.head<2>()) / lengths;
  const double sine = cross(from.x(), from.y(), to.x(), to.y()) / lengths;
  for (std::size_t k = 0; k < 8; ++k) {
    const Vector d = disc.corners[k] - c;
    disc.corners[k].x() = c.x() + cosine * d.x() - sine * d.y();
    disc.corners[k].y() = c.y() + sine * d.x() + cosine * d.y();
  }
}

/// What a line of that roundness falls away at `distance` beside it.
double fall(double roundness, double distance) {
  if (!(roundness > distance)) return distance > 0 ? distance : 0;
  return roundness - std::sqrt(roundness * roundness - distance * distance);
}

/// The ends of two nearly parallel lines that lie beside the other line.
struct LineEnds {
  const SupportFeature &A, &B;
  const double slack;
  FeatureContacts& contacts;
  int count = 0;
  double shallowest = -std::numeric_limits<double>::infinity();  ///< of their separations, m

  void add(bool of_B, std::size_t end) {
    const SupportFeature &line = of_B ? B : A, &other = of_B ? A : B;
    const Vector& p = line.corners[end];
    const Vector along = other.corners[1] - other.corners[0];
    const double t =
        (p - other.corners[0]).head<2>().dot(along.head<2>()) / along.head<2>().squaredNorm();
    if (!(t >= 0 && t <= 1)) return;
    const Vector q = other.corners[0] + along * t;
    // Between the lines, where both surfaces together have fallen away least.
    const double r_p = line.roundness[end];
    const double r_q = std::lerp(other.roundness[0], other.roundness[1], t);
    const bool is_sharp = r_p + r_q == 0;
    const double share = is_sharp ? 0.5 : r_p / (r_p + r_q);
    const double distance = (q - p).head<2>().norm();
    if (!is_sharp && distance > r_p + r_q) return;
    const Vector place = p + share * (q - p);
    if (of_B && contacts.any_within(slack, place.x(), place.y())) return;
    const double fall_p = fall(r_p, share * distance);
    const double fall_q = fall(r_q, (1 - share) * distance);
    const double z_A = of_B ? q.z() - fall_q : p.z() - fall_p;
    const double z_B = of_B ? p.z() + fall_p : q.z() + fall_q;
    contacts.add(place.x(), place.y(), z_A, z_B, name_corner(of_B, line.corner_names[end]));
    contacts.used().back().is_guess =
        is_sharp && 0.5 * (q - p).norm() > std::abs(z_B - z_A) + slack;
    shallowest = std::max(shallowest, z_B - z_A);
    ++count;
  }
};

void overlap_lines(const SupportFeature& A, const SupportFeature& B, double slack,
                   FeatureContacts& contacts) {
  const Vector a = A.corners[1] - A.corners[0], b = B.corners[1] - B.corners[0];
  const double length_A = a.head<2>().norm(), length_B = b.head<2>().norm();
  if (!(length_A > 0 && length_B > 0)) return;
  const Vector from = B.corners[0] - A.corners[0];
  const double turn = cross(a.x(), a.y(), b.x(), b.y());
  const double sine = std::abs(turn) / (length_A * length_B);

  bool has_crossing = false;
  double crossing_A = 0, crossing_B = 0;
  if (sine > 1e-9) {
    crossing_A = cross(from.x(), from.y(), b.x(), b.y()) / turn;
    crossing_B = cross(from.x(), from.y(), a.x(), a.y()) / turn;
    const double past_A = slack / length_A, past_B = slack / length_B;
    has_crossing = crossing_A >= -past_A && crossing_A <= 1 + past_A && crossing_B >= -past_B &&
                   crossing_B <= 1 + past_B;
    crossing_A = within(0, crossing_A, 1);
    crossing_B = within(0, crossing_B, 1);
  }
  const double z_A = A.corners[0].z() + a.z() * crossing_A;
  const double z_B = B.corners[0].z() + b.z() * crossing_B;

  if (sine < kNearlyParallel) {
    LineEnds ends{A, B, slack, contacts};
    for (const bool of_B : {false, true}) {
      for (const std::size_t end : {std::size_t{0}, std::size_t{1}}) ends.add(of_B, end);
    }
    if (ends.count >= 2 && ends.shallowest <= z_B - z_A + kAsDeep_m) return;
  }
  if (!has_crossing) return;
  const Vector p = A.corners[0] + a * crossing_A;
  // At an end it is that end: a name of its own would change ends as the lines turn.
  std::size_t end = contacts.find(slack, p.x(), p.y());
  const std::uint32_t name = end < contacts.count
                                 ? contacts.items[end].name
                                 : name_of_point(A, B, contacts.B_names, p.x(), p.y(), slack,
                                                 name_crossing(A.edge_names[0], B.edge_names[0]));
  end = std::min(end, contacts.find(name));
  if (end < contacts.count) contacts.items[end] = contacts.items[--contacts.count];
  contacts.add(p.x(), p.y(), z_A, z_B, name);
}

void overlap_faces(const SupportFeature& A, const SupportFeature& B, double slack,
                   FeatureContacts& contacts) {
  const Sides sides_A(A, 1), sides_B(B, -1);
  // The face that looks more along the normal is the reference; in a tie, that of A.
  constexpr double kLead = 1e-6;
  if (-B.normal.z() > A.normal.z() + kLead) {
    Clipper clipper(sides_B, false, A, slack, contacts);
    clipper.add_edges();
    clipper.add_corners_of_reference(sides_A);
  } else {
    Clipper clipper(sides_A, true, B, slack, contacts);
    clipper.add_edges();
    clipper.add_corners_of_reference(sides_B);
  }
}

/// The corner of a feature that is at a place; none: -1. Of discs none is at a place of its own.
int corner_at(const SupportFeature& feature, double x, double y, double slack) {
  if (feature.count == 1) return 0;
  for (int k = 0; k < feature.count && !feature.is_round; ++k) {
    const Vector& p = feature.corners[static_cast<std::size_t>(k)];
    if (std::abs(p.x() - x) <= slack && std::abs(p.y() - y) <= slack) return k;
  }
  return -1;
}

}  // namespace

std::uint32_t name_of_point(const SupportFeature& A, const SupportFeature& B, bool B_first,
                            double x, double y, double slack, std::uint32_t otherwise) {
  for (const bool of_B : {B_first, !B_first}) {
    const SupportFeature& feature = of_B ? B : A;
    const int corner = corner_at(feature, x, y, slack);
    if (corner >= 0)
      return name_corner(of_B, feature.corner_names[static_cast<std::size_t>(corner)]);
  }
  return otherwise;
}

bool is_flush(const SupportFeature& face) {
  return face.count > 2 && std::abs(face.normal.z()) > kTolerances.flush_cosine;
}

Vector common_point(const SupportFeature& A, const SupportFeature& B, const Vector& p,
                    double slack) {
  const auto misses = [&](const SupportFeature& face) {
    return (nearest_of(face, p) - p).head<2>().norm() > slack;
  };
  if (!(A.is_round || B.is_round) || !(misses(A) || misses(B))) return p;
  const Vector found =
      A.is_round ? nearest_of(B, middle_of(A)) : nearest_of_polygon(A, middle_of(B));
  return {found.x(), found.y(), p.z()};
}

void keep_highest(SupportFeature& feature, double up) {
  if (feature.count < 2) return;
  const auto count = static_cast<std::size_t>(feature.count);
  std::size_t top = 0;
  for (std::size_t k = 1; k < count; ++k) {
    if (up * feature.corners[k].z() > up * feature.corners[top].z()) top = k;
  }
  const auto keep_corner = [&] {
    feature.corners[0] = feature.corners[top];
    feature.corner_names[0] = feature.corner_names[top];
    feature.count = 1;
  };
  if (feature.is_round) return keep_corner();
  // The edges at the top, and where they begin.
  const std::size_t begins[2] = {top, (top + count - 1) % count};
  double flattest = 1;
  std::size_t begin = top;
  for (const std::size_t k : begins) {
    const Vector edge = feature.corners[(k + 1) % count] - feature.corners[k];
    const double slope2 = edge.z() * edge.z() / edge.squaredNorm();
    if (slope2 < flattest) flattest = slope2, begin = k;
  }
  constexpr double kLevel2 = 1 - kTolerances.flush_cosine * kTolerances.flush_cosine;
  if (flattest > kLevel2) {
    keep_corner();
  } else if (count > 2) {
    const std::size_t end = begin + 1 < count ? begin + 1 : 0;
    const Vector p = feature.corners[begin], q = feature.corners[end];
    const std::uint32_t name_p = feature.corner_names[begin], name_q = feature.corner_names[end];
    const std::uint32_t name = feature.edge_names[begin];
    feature.count = 0;
    feature.normal.setZero();
    feature.add(p, name_p, name);
    feature.add(q, name_q, name);
  }
}

void overlap_features(SupportFeature& A, SupportFeature& B, double slack,
                      FeatureContacts& contacts) {
  if (A.count < 2 || B.count < 2) return;
  if (A.is_level) turn_to(A, B);
  if (B.is_level) turn_to(B, A);
  if (A.count == 2 && B.count == 2) {
    overlap_lines(A, B, slack, contacts);
  } else if (A.count == 2 && B.is_round) {
    overlap_line_and_disc(A, B, false, slack, contacts);
  } else if (B.count == 2 && A.is_round) {
    overlap_line_and_disc(B, A, true, slack, contacts);
  } else if (A.count == 2) {
    Clipper(Sides(B, -1), false, A, slack, contacts).add_edges();
  } else if (B.count == 2) {
    Clipper(Sides(A, 1), true, B, slack, contacts).add_edges();
  } else {
    overlap_faces(A, B, slack, contacts);
  }
}

}  // namespace cradle
