// Let n be any direction: B moved out along n by h(n) + e is apart from A by e at least. The
// closest points then give a direction n' with h(n') <= h(n) cos(n, n'): this follows from |q - p|
// >= e for q = (h + e) n and its foot p on M. So the steps descend, and rest only where the foot
// lies on n: where a ball about the origin touches M from inside. Where M is flat one step arrives;
// where it is round with radius R, an error shrinks by (h + e) / (R + e) a step. (Where steps
// shrink steadily, their limit is guessed, and taken if it is lower; where they hardly shrink, as
// in deep overlaps, they are stretched.)
//
// Symbols as in least_overlap.cpp. Cost: a step takes closest points, 0.1 .. 0.2 us for polytopes
// and 0.5 .. 1.5 us for curved shapes.
#include "server/collision/descent.h"

#include <array>
#include <cmath>

#include "server/collision/polish.h"

namespace cradle {
namespace {

constexpr int kDescentStepsMax = 32;
constexpr int kPolished = 3;            // steps after which the rest may be left to Newton's method
constexpr double kAsLow_m = 1e-11;      // what that finds counts if it is no higher
constexpr double kDescentStill = 1e-5;  // rad: a step so small ends the descent; the error is less
constexpr double kDeepStill = 100;
constexpr double kRoughGap = 0.1;
constexpr double kRough = 1e-2;  // rad: while steps are larger, closest points need not be exact
constexpr int kRoughSteps = 6;
constexpr double kSlow = 0.3;  // of the last step: one that shrinks less is stretched

/// Where the last steps lead to if they shrink steadily (Anderson 1965, of depth two: the tangent
/// plane has two dimensions): from directions n and the directions g that came of them.
class Extrapolation {
 public:
  void add(const Vector& n, const Vector& g) {
    f_[2] = f_[1], f_[1] = f_[0], f_[0] = g - n;
    g_[2] = g_[1], g_[1] = g_[0], g_[0] = g;
    ++count_;
  }

  /// False if they lead nowhere.
  bool guess(Vector& n) const {
    if (count_ < 2) return false;
    const Vector u = f_[0] - f_[1], v = count_ < 3 ? Vector(Vector::Zero()) : Vector(f_[1] - f_[2]);
    const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
    const double uf = u.dot(f_[0]), vf = v.dot(f_[0]);
    const double determinant = uu * vv - uv * uv;
    double a = 0, b = 0;
    if (determinant > 1e-6 * uu * vv) {
      a = (uf * vv - vf * uv) / determinant;
      b = (vf * uu - uf * uv) / determinant;
    } else if (uu > 0) {
      a = uf / uu;
    } else {
      return false;
    }
    n = g_[0] - a * (g_[0] - g_[1]);
    if (b != 0) n -= b * (g_[1] - g_[2]);
    const double length = n.norm();
    n /= length;
    return length > 0.1;
  }

 private:
  std::array<Vector, 3> f_{Vector::Zero(), Vector::Zero(), Vector::Zero()}, g_ = f_;
  int count_ = 0;
};

/// Down from a direction to a local minimum.
class Descent {
 public:
  Descent(const ConvexPair& pair, Simplex& simplex, SupportHints& hints)
      : pair_(pair), simplex_(simplex), hints_(hints) {}

  /// Polishes what the first steps find, but not beside where it begins: a face is no curved part.
  LeastOverlap from(const Direction& begin) {
    best_ = {true, begin.n, begin.overlap, Vector::Zero()};
    const double e = pair_.small_length();
    const double thickness = std::min(pair_.A.thickness, pair_.B.thickness);
    const double gap = simplex_.gap;
    bool is_rough = true;
    double last_turn = kInfinity;
    for (int step = 0; step < kDescentStepsMax; ++step) {
      simplex_.gap = is_rough ? kRoughGap : gap;
      const Closest found =
          closest(pair_, (best_.overlap + e) * best_.n, best_.n, kInfinity, simplex_, hints_);
      if (found.kind != Closest::Kind::apart) break;
      best_.p_A = found.p_A;
      LeastOverlap polished;
      if (step < kPolished && (found.n - begin.n).squaredNorm() > kBesideFace2 &&
          polish(pair_, found.n, simplex_, hints_, polished) &&
          polished.overlap <= best_.overlap + kAsLow_m) {
        best_ = polished;
        break;
      }
      const Vector begin_n = best_.n;
      const double turn = (found.n - begin_n).norm();
      const bool is_lower = take_if_lower(found.n);
      if (!is_lower && !is_rough) break;
      // The deeper, the less a small step says about what is left.
      const double still =
          kDescentStill / (1 + kDeepStill * std::max(0.0, best_.overlap) / thickness);
      if (turn < still && !is_rough) break;
      const bool was_rough = is_rough;
      is_rough = is_rough && is_lower && turn > kRough && step < kRoughSteps;
      if (was_rough && !is_lower) continue;
      if (!was_rough) {
        extrapolation_.add(begin_n, found.n);
        Vector guess;
        if (extrapolation_.guess(guess) && take_if_lower(guess)) continue;
      }
      if (turn > kSlow * last_turn) stretch(begin_n, found.n);
      last_turn = turn;
    }
    simplex_.gap = gap;
    return best_;
  }

 private:
  bool take_if_lower(const Vector& n) {
    const double overlap = core_overlap(pair_, n, hints_);
    if (!(overlap <= best_.overlap)) return false;
    best_.n = n;
    best_.overlap = overlap;
    return true;
  }

  /// Farther the same way, as long as it goes down.
  void stretch(const Vector& n, const Vector& g) {
    for (double factor = 2; factor < 1000; factor *= 2) {
      const double before = best_.overlap;
      if (!take_if_lower((n + factor * (g - n)).normalized()) || best_.overlap == before) break;
    }
  }

  const ConvexPair& pair_;
  Simplex& simplex_;
  SupportHints& hints_;
  Extrapolation extrapolation_;
  LeastOverlap best_;
};

}  // namespace

LeastOverlap descend(const ConvexPair& pair, const Direction& from, SupportHints& hints) {
  Simplex simplex;
  return Descent(pair, simplex, hints).from(from);
}

}  // namespace cradle
