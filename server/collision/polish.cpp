// A local minimum of the overlap over all directions, by Newton's method on the sphere.
//
// Symbols: h(n) = max n . w over the corners w of M, the overlap; n unit, e its tangents, d a step
// in them. A piece is a smooth part of M's surface: a corner, edge of a disc, or ellipsoid of A
// less one of B. With w_i the point of piece i for n, s_i = n . w_i, g_i = e . w_i and H_i its
// second derivatives,
//   h(n + d) / |n + d| = max_i s_i + g_i . d + d . (H_i - h) d / 2 + O(d^3).
// At the minimum up to three pieces have the same s, and a mean of them, with weights m_i that are
// not negative, has sum m_i g_i = 0: it is the foot of the origin. So a step solves
//   s_i + g_i . d equal for all pieces held,  sum m_i (g_i + (H_i - h) d) = 0,  sum m_i = 1,
// lets go of pieces with negative weights, and takes up the one that then is farthest. A step that
// leads up is halved.
// (Sequential quadratic programming: Nocedal and Wright, "Numerical Optimization" (2006), 18.1.)
//
// Cost: 60 .. 100 ns a step; 3 to 5 steps.
#include "server/collision/polish.h"

#include <cmath>
#include <span>

namespace cradle {
namespace {

constexpr int kPolishStepsMax = 10;
constexpr double kPolishLongest = 0.25;  // rad, of a step: beyond, the series says little
constexpr double kArrived = 1e-8;        // rad: the error left is its square
constexpr double kAsFar = 1e-11;         // m
constexpr double kSamePlace_m = 1e-9;    // points of B come back from A's frame with rounding
constexpr double kInLine = 1e-6;         // a sine
constexpr double kFlatRim = 0.2, kApart = 0.3;  // of faces in rims: a sine; of the radius
constexpr double kNegative = -1e-9;             // of a weight

/// Part of one shape: a corner, or a curved part with something that tells it from others.
struct Part {
  Vector anchor;
  bool is_curved;

  bool operator==(const Part& other) const {
    return is_curved == other.is_curved &&
           (anchor - other.anchor).squaredNorm() < kSamePlace_m * kSamePlace_m;
  }
};

bool is_on_rim(const ConvexShape& shape, const Vector& p) {
  return shape.kind == ShapeKind::cylinder || (shape.kind == ShapeKind::cone && p.z() < 0);
}

/// `of_face` tells that a rim bounds the face that counts, so that each of its points is a corner.
Part part_at(const ConvexShape& shape, const Vector& p, bool of_face) {
  switch (shape.kind) {
    case ShapeKind::cylinder:
    case ShapeKind::cone:
      return is_on_rim(shape, p) && !of_face ? Part{{0, 0, p.z()}, true} : Part{p, false};
    case ShapeKind::ellipsoid:
      return {Vector::Zero(), true};
    default:
      return {p, false};
  }
}

/// Whether points of a rim are so far apart that the foot is on the face in the rim.
bool is_on_face(const ConvexShape& shape, const Vector& n, std::span<const Vector> points) {
  const double across2 = n.x() * n.x() + n.y() * n.y();
  if (points.size() < 2 || !(across2 < kFlatRim * kFlatRim)) return false;
  const double apart = kApart * shape.size.x();
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    for (std::size_t j = i + 1; j < points.size(); ++j) {
      if (is_on_rim(shape, points[i]) && points[i].z() == points[j].z() &&
          (points[i] - points[j]).squaredNorm() > apart * apart) {
        return true;
      }
    }
  }
  return false;
}

struct Bend {
  double xx = 0, xy = 0, yy = 0;
};

/// The point of the part for the unit vector d, and adds its second derivatives along the tangents
/// e and f. False where they are infinite.
bool look(const ConvexShape& shape, const Part& part, const Vector& d, const Vector& e,
          const Vector& f, Vector& p, Bend& bend) {
  p = part.anchor;
  if (!part.is_curved) return true;
  if (shape.kind == ShapeKind::ellipsoid) {
    const Vector squares = shape.size.cwiseProduct(shape.size);
    const Vector square_e = squares.cwiseProduct(e), square_f = squares.cwiseProduct(f);
    const double inverse = 1 / shape.size.cwiseProduct(d).norm();
    p = squares.cwiseProduct(d) * inverse;
    const double p_e = p.dot(e), p_f = p.dot(f);
    bend.xx += (e.dot(square_e) - p_e * p_e) * inverse;
    bend.xy += (e.dot(square_f) - p_e * p_f) * inverse;
    bend.yy += (f.dot(square_f) - p_f * p_f) * inverse;
    return true;
  }
  const double across = std::sqrt(d.x() * d.x() + d.y() * d.y());
  if (!(across > 1e-9)) return false;
  const double x = d.x() / across, y = d.y() / across, r = shape.size.x();
  p.x() = r * x;
  p.y() = r * y;
  const double e_t = x * e.y() - y * e.x(), f_t = x * f.y() - y * f.x();
  const double k = r / across;
  bend.xx += k * e_t * e_t;
  bend.xy += k * e_t * f_t;
  bend.yy += k * f_t * f_t;
  return true;
}

struct Piece {
  Part A, B;
  double weight;
  // At the direction of the step:
  Vector w, a;
  double s, gx, gy;
  Bend bend;

  bool is_same(const Piece& other) const { return A == other.A && B == other.B; }
};

class Polish {
 public:
  Polish(const ConvexPair& pair, SupportHints& hints) : pair_(pair), hints_(hints) {}

  bool from(const Vector& begin, Simplex& simplex, LeastOverlap& least, AtFace at_face) {
    begin_with(begin, simplex);
    if (at_face == AtFace::give_up && (on_face_A_ || on_face_B_)) return false;
    double least_so_far = kInfinity;
    for (int step = 0; step < kPolishStepsMax; ++step) {
      const Vector before = n_;
      double length2 = 0;
      if (!take_step(length2)) return false;
      const Difference far = support(pair_, n_, hints_);
      if (length2 < kArrived * kArrived && is_valley_ && is_held(n_.dot(far.w))) {
        finish(far, simplex, least);
        return true;
      }
      hold(piece_at(far.a, far.w, 0));
      const double overlap = n_.dot(far.w);
      if (overlap > least_so_far + kAsFar) {
        n_ = (before + n_).normalized();  // too far
      } else {
        least_so_far = overlap;
      }
    }
    return false;
  }

 private:
  /// The pieces between which closest points are; else the farthest.
  void begin_with(const Vector& begin, const Simplex& simplex) {
    const std::size_t given = std::min(simplex.count, pieces_.size());
    std::array<Vector, 3> a, b;
    for (std::size_t i = 0; i < given; ++i) {
      a[i] = simplex.corners[i].a;
      b[i] = pair_.R.transpose() * (a[i] - simplex.corners[i].w - pair_.t);
    }
    on_face_A_ = is_on_face(pair_.A, begin, std::span(a).first(given));
    on_face_B_ = is_on_face(pair_.B, pair_.R.transpose() * begin, std::span(b).first(given));
    for (std::size_t i = 0; i < given; ++i) {
      take(piece_at(simplex.corners[i].a, simplex.corners[i].w, simplex.weights[i]));
    }
    n_ = begin;
    if (count_ > 0) return;
    const Difference far = support(pair_, n_, hints_);
    take(piece_at(far.a, far.w, 1));
  }

  /// To where the pieces held say that the minimum is. False if they say nothing. `length2` is that
  /// of the step, rad^2.
  bool take_step(double& length2) {
    if (!look_from_here()) return false;
    double dx = 0, dy = 0;
    has_turned_ = false;
    while (!solve(dx, dy)) {
      if (!let_go()) return false;
    }
    length2 = dx * dx + dy * dy;
    if (!(length2 < kInfinity)) return false;
    if (length2 > kPolishLongest * kPolishLongest) {
      const double shorter = kPolishLongest / std::sqrt(length2);
      dx *= shorter;
      dy *= shorter;
      length2 = kPolishLongest * kPolishLongest;
    }
    const Vector next = (n_ + dx * e_ + dy * f_) / std::sqrt(1 + length2);
    n_ = next;
    return true;
  }

  /// Whether no piece is farther than those that are held.
  bool is_held(double overlap) const {
    double held = pieces_[0].w.dot(n_);
    for (std::size_t i = 1; i < count_; ++i) held = std::max(held, pieces_[i].w.dot(n_));
    return overlap <= held + kAsFar;
  }

  void finish(const Difference& far, Simplex& simplex, LeastOverlap& least) const {
    least = {true, n_, n_.dot(far.w), Vector::Zero()};
    for (std::size_t i = 0; i < count_; ++i) {
      least.p_A += pieces_[i].weight * pieces_[i].a;
      simplex.corners[i] = {pieces_[i].w, pieces_[i].a, 0};
      simplex.weights[i] = pieces_[i].weight;
    }
    simplex.count = count_;
    if (count_ == 1) simplex.corners[0] = far;
  }

  void hold(const Piece& piece) {
    for (std::size_t i = 0; i < count_; ++i) {
      if (pieces_[i].is_same(piece)) return;
    }
    if (count_ == 3) drop(lightest());
    pieces_[count_++] = piece;
  }

  Piece piece_at(const Vector& a, const Vector& w, double weight) const {
    Piece piece;
    const Vector b = pair_.R.transpose() * (a - w - pair_.t);
    piece.A = part_at(pair_.A, a, on_face_A_);
    piece.B = part_at(pair_.B, b, on_face_B_);
    piece.weight = weight;
    return piece;
  }
  void take(const Piece& piece) {
    for (std::size_t i = 0; i < count_; ++i) {
      if (pieces_[i].is_same(piece)) {
        pieces_[i].weight += piece.weight;
        return;
      }
    }
    pieces_[count_++] = piece;
  }
  std::size_t lightest() const {
    std::size_t least = 0;
    for (std::size_t i = 1; i < count_; ++i) {
      if (pieces_[i].weight < pieces_[least].weight) least = i;
    }
    return least;
  }
  void drop(std::size_t i) { pieces_[i] = pieces_[--count_]; }

  bool look_from_here() {
    const Vector helper = std::abs(n_.x()) < 0.57 ? Vector::UnitX() : Vector::UnitY();
    e_ = helper.cross(n_).normalized();
    f_ = n_.cross(e_);
    const Matrix to_B = pair_.R.transpose();
    const Vector d_B = -(to_B * n_), e_B = to_B * e_, f_B = to_B * f_;
    h_ = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < count_; ++i) {
      Piece& piece = pieces_[i];
      piece.bend = {};
      Vector b;
      if (!look(pair_.A, piece.A, n_, e_, f_, piece.a, piece.bend)) return false;
      if (!look(pair_.B, piece.B, d_B, e_B, f_B, b, piece.bend)) return false;
      piece.w = piece.a - (pair_.R * b + pair_.t);
      piece.s = n_.dot(piece.w);
      piece.gx = e_.dot(piece.w);
      piece.gy = f_.dot(piece.w);
      h_ = std::max(h_, piece.s);
    }
    return true;
  }

  /// False if some weight is negative.
  bool solve(double& dx, double& dy) {
    Bend mean{-h_, 0, -h_};
    for (std::size_t i = 0; i < count_; ++i) {
      const Piece& p = pieces_[i];
      mean.xx += p.weight * p.bend.xx;
      mean.xy += p.weight * p.bend.xy;
      mean.yy += p.weight * p.bend.yy;
    }
    if (count_ == 1) return solve_one(mean, dx, dy);
    return count_ == 2 ? solve_two(mean, dx, dy) : solve_three(mean, dx, dy);
  }

  /// One piece: down its slope, as it bends.
  bool solve_one(Bend bend, double& dx, double& dy) {
    auto& [xx, xy, yy] = bend;
    const Piece& p = pieces_[0];
    is_valley_ = xx * yy - xy * xy > 0 && xx + yy > 0;
    if (!is_valley_) xx += 2 * h_, yy += 2 * h_;
    const double determinant = xx * yy - xy * xy;
    if (!(determinant > 0)) return dx = kInfinity, true;
    dx = (xy * p.gy - yy * p.gx) / determinant;
    dy = (xy * p.gx - xx * p.gy) / determinant;
    pieces_[0].weight = 1;
    return true;
  }

  /// Two: to the line on which both are as far, and down along it.
  bool solve_two(const Bend& mean, double& dx, double& dy) {
    const auto& [xx, xy, yy] = mean;
    const Piece &p = pieces_[0], &q = pieces_[1];
    const double x = p.gx - q.gx, y = p.gy - q.gy, length2 = x * x + y * y;
    double bend = y * y * xx - 2 * x * y * xy + x * x * yy;  // times length2
    is_valley_ = bend > 0;
    if (!is_valley_) bend += 2 * h_ * length2;
    if (!(length2 > 0 && bend > 0)) return dx = kInfinity, true;
    const double back = (q.s - p.s) / length2;  // along (x, y)
    const double slope =
        x * p.gy - y * p.gx + back * (x * (xy * x + yy * y) - y * (xx * x + xy * y));
    const double along = -slope / bend;  // along (-y, x)
    dx = back * x - along * y;
    dy = back * y + along * x;
    const double rest_x = q.gx + xx * dx + xy * dy, rest_y = q.gy + xy * dx + yy * dy;
    pieces_[0].weight = -(rest_x * x + rest_y * y) / length2;
    pieces_[1].weight = 1 - pieces_[0].weight;
    return pieces_[0].weight >= kNegative && pieces_[1].weight >= kNegative;
  }

  /// Three: to the point where all are as far.
  bool solve_three(const Bend& mean, double& dx, double& dy) {
    const auto& [xx, xy, yy] = mean;
    const Piece &p = pieces_[0], &q = pieces_[1], &r = pieces_[2];
    is_valley_ = true;
    const double x1 = p.gx - r.gx, y1 = p.gy - r.gy, x2 = q.gx - r.gx, y2 = q.gy - r.gy;
    const double determinant = x1 * y2 - y1 * x2;
    if (determinant * determinant <=
        kInLine * kInLine * (x1 * x1 + y1 * y1) * (x2 * x2 + y2 * y2)) {
      return false;  // on a line: two of them do
    }
    const double c1 = r.s - p.s, c2 = r.s - q.s;
    dx = (c1 * y2 - y1 * c2) / determinant;
    dy = (x1 * c2 - c1 * x2) / determinant;
    const double rest_x = r.gx + xx * dx + xy * dy, rest_y = r.gy + xy * dx + yy * dy;
    pieces_[0].weight = (x2 * rest_y - y2 * rest_x) / determinant;
    pieces_[1].weight = (y1 * rest_x - x1 * rest_y) / determinant;
    pieces_[2].weight = 1 - pieces_[0].weight - pieces_[1].weight;
    return pieces_[lightest()].weight >= kNegative;
  }

  /// Where two edges cross, four pieces are as far, and one of two triangles of them holds the
  /// foot: takes the other one.
  bool turn_over(std::size_t light) {
    if (has_turned_ || count_ < 3) return false;
    std::size_t i = light == 0 ? 1 : 0, j = light == 2 ? 1 : 2;
    Piece& gone = pieces_[light];
    if (!(gone.A == pieces_[i].A && gone.B == pieces_[j].B)) std::swap(i, j);
    if (!(gone.A == pieces_[i].A && gone.B == pieces_[j].B)) return false;
    has_turned_ = true;
    Piece &p = pieces_[i], &q = pieces_[j];
    Piece piece = q;
    piece.A = q.A;
    piece.B = p.B;
    piece.weight = -gone.weight;
    p.weight += gone.weight;
    q.weight += gone.weight;
    piece.w = p.w + q.w - gone.w;
    piece.s = p.s + q.s - gone.s;
    piece.gx = p.gx + q.gx - gone.gx;
    piece.gy = p.gy + q.gy - gone.gy;
    piece.bend.xx += p.bend.xx - gone.bend.xx;
    piece.bend.xy += p.bend.xy - gone.bend.xy;
    piece.bend.yy += p.bend.yy - gone.bend.yy;
    gone = piece;
    return true;
  }

  bool let_go() {
    if (count_ == 1) return false;
    const std::size_t light = lightest();
    if (turn_over(light)) return true;
    drop(light);
    double sum = 0;
    for (std::size_t i = 0; i < count_; ++i) sum += std::max(0.0, pieces_[i].weight);
    if (!(sum > 0)) return false;
    for (std::size_t i = 0; i < count_; ++i) {
      pieces_[i].weight = std::max(0.0, pieces_[i].weight) / sum;
    }
    return true;
  }

  const ConvexPair& pair_;
  SupportHints& hints_;
  std::array<Piece, 3> pieces_;
  std::size_t count_ = 0;
  bool on_face_A_ = false, on_face_B_ = false;
  Vector n_, e_, f_;
  double h_ = 0;
  bool has_turned_ = false;
  bool is_valley_ = true;  ///< where the step was taken; else it was one down a ridge
};

}  // namespace

bool polish(const ConvexPair& pair, const Vector& n, Simplex& simplex, SupportHints& hints,
            LeastOverlap& least, AtFace at_face) {
  return Polish(pair, hints).from(n, simplex, least, at_face);
}

}  // namespace cradle
