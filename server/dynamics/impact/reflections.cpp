// Generalised reflections: simultaneous impacts that keep energy, momentum and symmetry.
//
// Source: Smith, Kaufman, Vouga, Tamstorf, Grinspun (2012), "Reflections on Simultaneous Impact".
//   repeat: V = { contacts that approach }; in each connected part of V
//     find 0 <= l, A l + b >= 0, l . (A l + b) = 0;  apply (1 + e) l;
//   until V is empty.
// Where we differ: with unequal e in one part this may gain energy, by
//   dE = (|E l|^2 - |l|^2) / 2,  |x|^2 = x . A x,  E = diag(e)
// so e is scaled there by kappa = min(1, e_max |l| / |E l|). Equal e needs no scale: dE is then
// (e^2 - 1) |l|^2 / 2.
// Cost: about 0.1 us a contact for a few, n^3 for many; a chain of n takes n - 1 rounds.
#include "server/dynamics/impact/reflections.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

namespace cradle {
namespace {

/// Slower approach is none, of the fastest in the set: rounding of a few sums.
constexpr double kReflectionStill = 1e-12;
/// Then a round without restitution ends it (inelastic collapse).
constexpr int kRoundsMax = 64;
/// Makes redundant contacts definite, of the largest of the diagonal.
constexpr double kDefinite = 1e-14;
constexpr int kPivotsMax = 512;
constexpr int kReflectionSweepsMax = 1000;

using Index = Eigen::Index;
using Contacts = Eigen::Matrix<Index, Eigen::Dynamic, 1, Eigen::ColMajor, kReflectedTogether, 1>;

/// l with 0 <= l, A l + b >= 0, and one of both 0 in every place: principal pivots of the smallest
/// index (Murty 1974), begun with all of them pressed, which is right most of the time.
class Compression {
 public:
  Compression(const ImpactMatrix& A, const ImpactVector& b) : A_(A), b_(b), n_(b.size()) {
    is_pressed_.fill(true);
  }

  ImpactVector solve() {
    const double small = kReflectionStill * b_.cwiseAbs().maxCoeff();
    for (int pivot = 0; pivot < kPivotsMax; ++pivot) {
      find_impulses();
      const ImpactVector after = A_ * l_ + b_;
      Index wrong = 0;
      while (wrong < n_ && !(is_pressed_[place(wrong)] ? l_[wrong] < 0 : after[wrong] < -small)) {
        ++wrong;
      }
      if (wrong == n_) return l_;
      is_pressed_[place(wrong)] = !is_pressed_[place(wrong)];
    }
    return by_sweeps();
  }

 private:
  static std::size_t place(Index i) { return static_cast<std::size_t>(i); }

  void find_impulses() {
    Contacts F(0);
    for (Index i = 0; i < n_; ++i) {
      if (!is_pressed_[place(i)]) continue;
      F.conservativeResize(F.size() + 1);
      F[F.size() - 1] = i;
    }
    const ImpactMatrix A = A_(F, F);
    ImpactMatrix definite = A;
    definite.diagonal().array() += kDefinite * A_.diagonal().maxCoeff();
    const Eigen::LDLT<ImpactMatrix> factors(definite);
    ImpactVector l = factors.solve(ImpactVector(-b_(F)));
    l -= factors.solve(ImpactVector(A * l + b_(F)));
    l_ = ImpactVector::Zero(n_);
    l_(F) = l;
  }

  ImpactVector by_sweeps() const {
    ImpactVector l = ImpactVector::Zero(n_);
    for (int sweep = 0; sweep < kReflectionSweepsMax; ++sweep) {
      for (Index i = 0; i < n_; ++i) {
        l[i] = std::max(0.0, l[i] - (A_.row(i).dot(l) + b_[i]) / A_(i, i));
      }
    }
    return l;
  }

  const ImpactMatrix& A_;
  const ImpactVector& b_;
  Index n_;
  std::array<bool, kReflectedTogether> is_pressed_{};
  ImpactVector l_;
};

/// Of those among `waiting` the first, and all that act on each other with it; they leave
/// `waiting`.
Contacts take_part(const ImpactMatrix& A, Contacts& waiting) {
  Contacts part(1);
  part[0] = waiting[0];
  std::array<bool, kReflectedTogether> is_taken{};
  is_taken[0] = true;
  for (Index k = 0; k < part.size(); ++k) {
    for (Index i = 0; i < waiting.size(); ++i) {
      if (is_taken[static_cast<std::size_t>(i)] || A(part[k], waiting[i]) == 0) continue;
      is_taken[static_cast<std::size_t>(i)] = true;
      part.conservativeResize(part.size() + 1);
      part[part.size() - 1] = waiting[i];
    }
  }
  Index left = 0;
  for (Index i = 0; i < waiting.size(); ++i) {
    if (!is_taken[static_cast<std::size_t>(i)]) waiting[left++] = waiting[i];
  }
  waiting.conservativeResize(left);
  return part;
}

/// What restitution may be multiplied by, so that no energy is gained.
double energy_scale(const ImpactMatrix& A, const ImpactVector& l, const ImpactVector& e) {
  const double most = e.maxCoeff();
  if (e.minCoeff() == most) return 1;
  const ImpactVector El = e.cwiseProduct(l);
  const double returned = El.dot(A * El);
  return returned > 0 ? std::min(1.0, most * std::sqrt(l.dot(A * l) / returned)) : 1;
}

Contacts approaching(const ImpactVector& velocities, double still) {
  Contacts V(0);
  for (Index i = 0; i < velocities.size(); ++i) {
    if (velocities[i] >= -still) continue;
    V.conservativeResize(V.size() + 1);
    V[V.size() - 1] = i;
  }
  return V;
}

}  // namespace

Reflection reflect(const ImpactMatrix& A, const ImpactVector& b, const ImpactVector& e) {
  Reflection result;
  result.impulses = ImpactVector::Zero(b.size());
  result.velocities = b;
  const double still = kReflectionStill * b.cwiseAbs().maxCoeff();
  while (result.is_elastic) {
    Contacts V = approaching(result.velocities, still);
    if (V.size() == 0) break;
    result.is_elastic = result.rounds++ < kRoundsMax;
    if (!result.is_elastic) V = Contacts::LinSpaced(b.size(), 0, b.size() - 1);
    ImpactVector change = ImpactVector::Zero(b.size());
    while (V.size() > 0) {
      const Contacts part = take_part(A, V);
      const ImpactMatrix A_part = A(part, part);
      const ImpactVector b_part = result.velocities(part), e_part = e(part);
      ImpactVector l = Compression(A_part, b_part).solve();
      if (result.is_elastic) l += energy_scale(A_part, l, e_part) * e_part.cwiseProduct(l);
      change(part) = l;
    }
    result.impulses += change;
    result.velocities += A * change;
  }
  return result;
}

}  // namespace cradle
