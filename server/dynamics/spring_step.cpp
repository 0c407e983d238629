// Springs with damping as implicit soft constraints.
//
// Source: the energy-momentum method: Simo, Tarnow 1992, "The discrete energy-momentum method",
// ZAMP 43 (springs); Simo, Wong 1991, "Unconditionally stable algorithms for rigid body dynamics",
// IJNME 31 (rotation). In our symbols, bars for the mean of start and end:
//   x1 = x0 + h v_,  m (v1 - v0) = h (F + sum f)
//   R1 = R0 cay(h W_),  R1 J W1 - R0 J W0 = h (T + sum r_ x f),  r = R r_B the arm
//   d = p_b - p_a, l = |d|:  f on b = -k (1 - L / l_) d_ - c n (n . (d1 - d0) / h),  n = d_ / |d_|
// The work of f over the step is then exactly -k/2 ((l1 - L)^2 - (l0 - L)^2) minus what c takes,
// for any motion and any k: energy does not rise, however stiff the spring, and linear and angular
// momentum are kept. Newton's method solves for (v1, W1) of all bodies at once; where it does not
// converge, springs beyond the step's resolution are damped until they creep (below); then the step
// is halved, up to six times; at last impulses do (spring_impulses.h), which is counted.
// Where we differ: undamped, a spring that the step cannot resolve would ring for ever between two
// states. So with s = h (sqrt(k / mu) + c / mu) and g = s^4 / (100 + s^4), mu the mass it moves,
// the damping is raised by g k h / 2, and after the step an impulse along the spring takes its
// velocity by the part g to its mean over the step, never beyond what it was. Both only lose
// energy, both keep momentum. At s = 1 the damping takes 3 % of the energy in a period, and falls
// as s^5; far above it the spring is a rod that comes to rest within a step. Drag acts at the mean
// velocity; torques are constant in W (or in B, taken at mid-step).
//
// Which scheme: this one, whatever the world's scheme; a spring to an outside point inside a scheme
// of schemes/ is for comparing schemes.
// Order: 2 in smooth motion.
// Stability: at every h, k and c.
// Energy: never gained; kept by springs without damping that the step resolves.
// Cost: about 4 iterations, 4 us for one body and one spring.
#include "server/dynamics/spring_step.h"

#include <Eigen/LU>
#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>

#include "server/dynamics/gyroscopic.h"
#include "server/dynamics/rotation.h"
#include "server/dynamics/spring_impulses.h"

namespace cradle {
namespace {

constexpr int kIterationsMax = 60;
constexpr int kHalvingsMax = 6;
constexpr double kConverged = 1e-13;    // of the velocity, a Newton step
constexpr double kTurnMax_rad = 0.7;    // a Newton step: it is linear in the turn
constexpr double kStalled = 1e-7;       // likewise, where rounding of a stiff force ends progress
constexpr Eigen::Index kDenseMax = 96;  // unknowns; beyond it, sparse factors
constexpr double kResolved = 100;       // s^4 at which half of a mode is damped away

/// A body between the step's start and end.
struct BodyPath {
  Matrix R0, R1;
  Vector w0_B, w1_B;
  Vector v0, v1;
  Vector x0, x1;
};

class SpringStep {
 public:
  /// `creep`: time, in steps, that springs beyond the step's resolution take to relax.
  SpringStep(std::span<SpringBody> bodies, std::span<const SpringLink> links, double h,
             double creep)
      : bodies_(bodies),
        links_(links),
        h_(h),
        creep_(creep),
        paths_(bodies.size()),
        softness_(links.size()) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const Flight& flight = bodies[i].flight;
      BodyPath& path = paths_[i];
      path.R0 = path.R1 = flight.q.toRotationMatrix();
      path.v0 = path.v1 = flight.v;
      path.w0_B = path.w1_B = flight.q.conjugate() * flight.w;
      path.x0 = path.x1 = flight.x;
    }
    for (std::size_t i = 0; i < links.size(); ++i) softness_[i] = softness(links[i]);
  }

  /// False if the equations could not be solved; the bodies are as they were then.
  bool solve(SpringReport& report) {
    const auto size = static_cast<Eigen::Index>(6 * bodies_.size());
    Eigen::VectorXd step = Eigen::VectorXd::Zero(size);
    double last = std::numeric_limits<double>::infinity();
    move(step);
    for (int iteration = 0; iteration < kIterationsMax; ++iteration) {
      ++report.evaluations;
      const Eigen::VectorXd r = residual();
      if (!r.allFinite()) return false;
      step = newton_step(r);
      if (!step.allFinite()) return false;
      step *= std::min(1.0, kTurnMax_rad / turn_of(step));
      move(step);
      const double change = relative_size(step);
      // At the rounding of a stiff spring's force the steps no longer shrink.
      if (change <= kConverged || (change <= kStalled && change >= last / 2)) return true;
      if (iteration > 30 && change > last) return false;
      last = change;
    }
    return false;
  }

  void finish() {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      Flight& flight = bodies_[i].flight;
      const BodyPath& path = paths_[i];
      const Rotation turn = turn_of(i);
      flight.x = path.x1;
      flight.v = path.v1;
      flight.q = normalised(flight.q * turn);
      flight.w = flight.q * path.w1_B;
    }
    for (std::size_t i = 0; i < links_.size(); ++i) calm(i);
  }

 private:
  Rotation turn_of(std::size_t i) const {
    const BodyPath& path = paths_[i];
    if (!bodies_[i].inertia.turns()) return rotation_exp(h_ * path.w0_B);
    const Vector half = h_ / 4 * (path.w0_B + path.w1_B);
    return normalised(Rotation(1, half.x(), half.y(), half.z()));
  }

  /// The largest turn that a Newton step gives to a body, rad.
  double turn_of(const Eigen::VectorXd& step) const {
    double most = 1e-300;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      most = std::max(most, h_ / 2 * step.segment<3>(static_cast<Eigen::Index>(6 * i + 3)).norm());
    }
    return most;
  }

  /// Takes a Newton step and brings the poses up to date.
  void move(const Eigen::VectorXd& step) {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      BodyPath& path = paths_[i];
      const auto at = static_cast<Eigen::Index>(6 * i);
      path.v1 -= step.segment<3>(at);
      path.w1_B -= step.segment<3>(at + 3);
      path.x1 = path.x0 + h_ / 2 * (path.v0 + path.v1);
      path.R1 = path.R0 * turn_of(i).toRotationMatrix();
    }
  }

  double relative_size(const Eigen::VectorXd& step) const {
    double worst = 0;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const BodyPath& path = paths_[i];
      const auto at = static_cast<Eigen::Index>(6 * i);
      // What rounding of the place comes to as a velocity.
      const double blur = 1e-2 * (path.x0.norm() + 1e-3) / h_;
      const double v = path.v0.norm() + path.v1.norm() + blur;
      const double w = path.w0_B.norm() + path.w1_B.norm() + blur + 1e-2 / h_;
      worst = std::max({worst, step.segment<3>(at).norm() / v, step.segment<3>(at + 3).norm() / w});
    }
    return worst;
  }

  struct EndAt {
    Vector p0, p1;  // the point at the step's start and end
    Vector arm;     // the mean of the arm
  };
  EndAt end_at(const SpringEnd& end) const {
    if (end.body < 0) return {end.point, end.end, Vector::Zero()};
    const BodyPath& path = paths_[static_cast<std::size_t>(end.body)];
    const Vector r0 = path.R0 * end.point, r1 = path.R1 * end.point;
    return {path.x0 + r0, path.x1 + r1, (r0 + r1) / 2};
  }

  /// The force on b, and minus its derivative by d1.
  struct Pull {
    Vector force_W;
    Matrix stiffness;
  };
  Pull pull(std::size_t i, const EndAt& a, const EndAt& b) const {
    const SpringLink& link = links_[i];
    const Vector d0 = b.p0 - a.p0, d1 = b.p1 - a.p1;
    const Vector middle = (d0 + d1) / 2;
    const double l0 = d0.norm(), l1 = d1.norm(), l = (l0 + l1) / 2;
    const double damping = link.damping + softness_[i] * link.stiffness * h_ * (0.5 + creep_);
    const Matrix one = Matrix::Identity();
    if (link.rest_length == 0) {
      return {-link.stiffness * middle - damping / h_ * (d1 - d0),
              (link.stiffness / 2 + damping / h_) * one};
    }
    const double length = middle.norm();
    if (!(l1 > 0 && length > 1e-14 * l)) return {Vector::Zero(), Matrix::Zero()};
    const Vector n = middle / length;
    const double secant = link.stiffness * (1 - link.rest_length / l);
    const double rate = n.dot(d1 - d0) / h_;
    const Matrix dn = (one - n * n.transpose()) / (2 * length);  // d n / d d1
    const Matrix elastic = secant / 2 * one + link.stiffness * link.rest_length / (2 * l * l * l1) *
                                                  middle * d1.transpose();
    const Matrix viscous =
        damping / h_ * n * (n + dn * (d1 - d0)).transpose() + damping * rate * dn;
    return {-secant * middle - damping * rate * n, elastic + viscous};
  }

  Eigen::VectorXd residual() const {
    Eigen::VectorXd r(static_cast<Eigen::Index>(6 * bodies_.size()));
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const SpringBody& body = bodies_[i];
      const BodyPath& path = paths_[i];
      const auto at = static_cast<Eigen::Index>(6 * i);
      const Vector w_B = (path.w0_B + path.w1_B) / 2;
      const Resistance drag = resistance(body.drag, (path.v0 + path.v1) / 2, w_B);  // torque in B
      r.segment<3>(at) =
          body.inertia.mass * (path.v1 - path.v0) - h_ * (body.force_W + drag.force_W);
      if (!body.inertia.turns()) {
        r.segment<3>(at + 3) = path.w1_B - path.w0_B;
        continue;
      }
      // In B at the step's start.
      const Vector& J = body.inertia.moments;
      const Matrix turn = path.R0.transpose() * path.R1;
      const Vector fixed_B = (body.torque_B + turn * body.torque_B) / 2;
      r.segment<3>(at + 3) = turn * J.cwiseProduct(path.w1_B) - J.cwiseProduct(path.w0_B) -
                             h_ * (path.R0.transpose() * body.torque_W + fixed_B + drag.torque_W);
    }
    for (std::size_t i = 0; i < links_.size(); ++i) {
      const EndAt a = end_at(links_[i].a), b = end_at(links_[i].b);
      const Vector impulse = h_ * pull(i, a, b).force_W;
      add_impulse(r, links_[i].a, a, impulse);
      add_impulse(r, links_[i].b, b, -impulse);
    }
    return r;
  }

  void add_impulse(Eigen::VectorXd& r, const SpringEnd& end, const EndAt& at,
                   const Vector& impulse) const {
    if (end.body < 0) return;
    const auto i = static_cast<std::size_t>(end.body);
    const auto row = static_cast<Eigen::Index>(6 * i);
    r.segment<3>(row) += impulse;
    if (!bodies_[i].inertia.turns()) return;
    r.segment<3>(row + 3) += paths_[i].R0.transpose() * at.arm.cross(impulse);
  }

  using Block = Eigen::Matrix<double, 6, 6>;

  /// Derivative of a body's own momentum by (v1, W1).
  Block own_block(std::size_t i) const {
    const SpringBody& body = bodies_[i];
    const BodyPath& path = paths_[i];
    Block block = Block::Identity();
    const Vector v = (path.v0 + path.v1) / 2;
    const double speed = v.norm();
    const Drag& drag = body.drag;
    block.topLeftCorner<3, 3>() *=
        body.inertia.mass + h_ / 2 * (drag.linear + drag.quadratic * speed);
    if (speed > 0) {
      block.topLeftCorner<3, 3>() += h_ / 2 * drag.quadratic / speed * v * v.transpose();
    }
    if (!body.inertia.turns()) return block;
    const Vector& J = body.inertia.moments;
    const Matrix turn = path.R0.transpose() * path.R1;
    block.bottomRightCorner<3, 3>() = turn * (J.asDiagonal().toDenseMatrix() -
                                              cross_matrix(J.cwiseProduct(path.w1_B)) * turning(i));
    block.bottomRightCorner<3, 3>().diagonal().array() += h_ / 2 * drag.angular;
    return block;
  }

  /// How the end's attitude turns with W1, in B: the differential of the Cayley map.
  Matrix turning(std::size_t i) const {
    const Vector xi = h_ / 2 * (paths_[i].w0_B + paths_[i].w1_B);
    return h_ / 2 / (1 + xi.squaredNorm() / 4) * (Matrix::Identity() - cross_matrix(xi) / 2);
  }

  /// d p1 / d (v1, W1)
  Eigen::Matrix<double, 3, 6> motion_of(const SpringEnd& end) const {
    const auto i = static_cast<std::size_t>(end.body);
    Eigen::Matrix<double, 3, 6> G;
    G.leftCols<3>() = h_ / 2 * Matrix::Identity();
    G.rightCols<3>().setZero();
    if (bodies_[i].inertia.turns()) {
      G.rightCols<3>() = -paths_[i].R1 * cross_matrix(end.point) * turning(i);
    }
    return G;
  }
  /// What an impulse at the end does to the residual.
  Eigen::Matrix<double, 6, 3> effect_on(const SpringEnd& end, const EndAt& at) const {
    const auto i = static_cast<std::size_t>(end.body);
    Eigen::Matrix<double, 6, 3> H;
    H.topRows<3>().setIdentity();
    H.bottomRows<3>().setZero();
    if (bodies_[i].inertia.turns()) {
      H.bottomRows<3>() = paths_[i].R0.transpose() * cross_matrix(at.arm);
    }
    return H;
  }

  /// The torque's change with the arm, which turns by half as much as the end.
  template <class Add>
  void add_arm(const SpringEnd& end, const Vector& force_W, Add&& add) const {
    const auto i = static_cast<std::size_t>(end.body);
    if (!bodies_[i].inertia.turns()) return;
    Block block = Block::Zero();
    block.bottomRightCorner<3, 3>() =
        h_ / 2 * paths_[i].R0.transpose() * cross_matrix(force_W) * motion_of(end).rightCols<3>();
    add(i, i, block);
  }

  template <class Add>
  void for_each_block(Add&& add) const {
    for (std::size_t i = 0; i < bodies_.size(); ++i) add(i, i, own_block(i));
    for (std::size_t i = 0; i < links_.size(); ++i) {
      const std::array<const SpringEnd*, 2> ends{&links_[i].a, &links_[i].b};
      const std::array<EndAt, 2> at{end_at(links_[i].a), end_at(links_[i].b)};
      const Pull now = pull(i, at[0], at[1]);
      const Matrix stiffness = h_ * now.stiffness;
      for (std::size_t row = 0; row < 2; ++row) {
        if (ends[row]->body < 0) continue;
        add_arm(*ends[row], row == 0 ? Vector(-now.force_W) : now.force_W, add);
        const Eigen::Matrix<double, 6, 3> H = effect_on(*ends[row], at[row]) * stiffness;
        for (std::size_t column = 0; column < 2; ++column) {
          if (ends[column]->body < 0) continue;
          const double sign = row == column ? 1 : -1;
          add(static_cast<std::size_t>(ends[row]->body),
              static_cast<std::size_t>(ends[column]->body),
              Block(sign * H * motion_of(*ends[column])));
        }
      }
    }
  }

  Eigen::VectorXd newton_step(const Eigen::VectorXd& r) const {
    const Eigen::Index size = r.size();
    if (size <= kDenseMax) {
      Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(size, size);
      for_each_block([&](std::size_t row, std::size_t column, const Block& block) {
        jacobian.block<6, 6>(static_cast<Eigen::Index>(6 * row),
                             static_cast<Eigen::Index>(6 * column)) += block;
      });
      return jacobian.partialPivLu().solve(r);
    }
    std::vector<Eigen::Triplet<double>> entries;
    for_each_block([&](std::size_t row, std::size_t column, const Block& block) {
      for (int i = 0; i < 6; ++i) {
        for (int j = 0; j < 6; ++j) {
          if (block(i, j) == 0) continue;
          entries.emplace_back(static_cast<int>(6 * row) + i, static_cast<int>(6 * column) + j,
                               block(i, j));
        }
      }
    });
    Eigen::SparseMatrix<double> jacobian(size, size);
    jacobian.setFromTriplets(entries.begin(), entries.end());
    Eigen::SparseLU<Eigen::SparseMatrix<double>> factors(jacobian);
    if (factors.info() != Eigen::Success) return Eigen::VectorXd::Constant(size, NAN);
    return factors.solve(r);
  }

  /// Inverse of the mass that the link moves, in W, with the bodies where they are.
  Matrix inverse_mass(const SpringLink& link) const {
    Matrix K = Matrix::Zero();
    for (const SpringEnd* end : {&link.a, &link.b}) {
      if (end->body < 0) continue;
      const SpringBody& body = bodies_[static_cast<std::size_t>(end->body)];
      K.diagonal().array() += 1 / body.inertia.mass;
      if (!body.inertia.turns()) continue;
      const Matrix arm = cross_matrix(body.flight.q * end->point);
      K -= arm *
           rotated_diagonal(body.flight.q.toRotationMatrix(), body.inertia.moments.cwiseInverse()) *
           arm;
    }
    return K;
  }

  Vector position(const SpringEnd& end) const {
    if (end.body < 0) return end.point;
    const Flight& flight = bodies_[static_cast<std::size_t>(end.body)].flight;
    return flight.x + flight.q * end.point;
  }

  /// g of this link, at the step's start.
  double softness(const SpringLink& link) const {
    const Matrix K = inverse_mass(link);
    const Vector d = position(link.b) - position(link.a);
    const double length = d.norm();
    const double k =
        link.rest_length == 0 || length == 0 ? K.trace() / 3 : d.dot(K * d) / (length * length);
    const double s = h_ * (std::sqrt(link.stiffness * k) + link.damping * k);
    const double s4 = std::min(s * s * s * s, 1e30);
    return s4 / (kResolved + s4);
  }

  /// After the step: takes the link's velocity towards its mean.
  void calm(std::size_t i) {
    const SpringLink& link = links_[i];
    const EndAt a = end_at(link.a), b = end_at(link.b);
    const Vector d1 = b.p1 - a.p1;
    const Vector mean = ((b.p1 - b.p0) - (a.p1 - a.p0)) / h_;
    const Vector now = velocity(link.b) - velocity(link.a);
    const Matrix K = inverse_mass(link);
    if (link.rest_length == 0) {
      const Matrix M = K.inverse();
      Vector target = now + softness_[i] * (mean - now);
      const double had = now.dot(M * now), has = target.dot(M * target);
      if (has > had) target *= std::sqrt(had / has);
      apply(link, M * (target - now));
      return;
    }
    const double length = d1.norm();
    if (length == 0) return;
    const Vector n = d1 / length;
    const double speed = std::abs(n.dot(now));
    const double target = std::clamp(n.dot(now + softness_[i] * (mean - now)), -speed, speed);
    apply(link, (target - n.dot(now)) / n.dot(K * n) * n);
  }

  Vector velocity(const SpringEnd& end) const {
    if (end.body < 0) return (end.end - end.point) / h_;
    const Flight& flight = bodies_[static_cast<std::size_t>(end.body)].flight;
    return flight.v + flight.w.cross(flight.q * end.point);
  }

  void apply(const SpringLink& link, const Vector& impulse) {
    for (const auto& [end, push] : {std::pair{&link.a, Vector(-impulse)}, {&link.b, impulse}}) {
      if (end->body < 0) continue;
      SpringBody& body = bodies_[static_cast<std::size_t>(end->body)];
      Flight& flight = body.flight;
      flight.v += push / body.inertia.mass;
      if (!body.inertia.turns()) continue;
      const Vector twist_B = flight.q.conjugate() * (flight.q * end->point).cross(push);
      flight.w += flight.q * twist_B.cwiseQuotient(body.inertia.moments);
    }
  }

  std::span<SpringBody> bodies_;
  std::span<const SpringLink> links_;
  double h_, creep_;
  std::vector<BodyPath> paths_;
  std::vector<double> softness_;  // g
};

void step_by_halves(std::span<SpringBody> bodies, std::vector<SpringLink> links, double h,
                    int halvings, SpringReport& report) {
  for (const double creep : {0.0, 4.0, 64.0, 1024.0}) {
    SpringStep step(bodies, links, h, creep);
    if (step.solve(report)) return step.finish();
  }
  if (halvings == kHalvingsMax) {
    ++report.unconverged;
    return spring_impulses(bodies, links, h);
  }
  std::vector<SpringLink> later = links;
  for (std::size_t i = 0; i < links.size(); ++i) {
    for (auto end : {&SpringLink::a, &SpringLink::b}) {
      const Vector middle = ((links[i].*end).point + (links[i].*end).end) / 2;
      if ((links[i].*end).body >= 0) continue;
      (links[i].*end).end = (later[i].*end).point = middle;
    }
  }
  step_by_halves(bodies, std::move(links), h / 2, halvings + 1, report);
  step_by_halves(bodies, std::move(later), h / 2, halvings + 1, report);
}

}  // namespace

SpringReport spring_step(std::span<SpringBody> bodies, std::span<const SpringLink> links,
                         double h) {
  SpringReport report;
  step_by_halves(bodies, {links.begin(), links.end()}, h, 0, report);
  return report;
}

double spring_energy(std::span<const SpringBody> bodies, std::span<const SpringLink> links) {
  const auto position = [&](const SpringEnd& end) {
    if (end.body < 0) return end.point;
    const Flight& flight = bodies[static_cast<std::size_t>(end.body)].flight;
    return Vector(flight.x + flight.q * end.point);
  };
  double energy_J = 0;
  for (const SpringLink& link : links) {
    const double stretch = (position(link.b) - position(link.a)).norm() - link.rest_length;
    energy_J += link.stiffness / 2 * stretch * stretch;
  }
  return energy_J;
}

}  // namespace cradle
