/// The convex problem of an island's contacts in a tick: see contact_island.cpp.
#pragma once

#include <span>
#include <vector>

#include "server/dynamics/contact/body_lines.h"
#include "server/dynamics/contact/newton/block_cholesky.h"

namespace cradle {

/// Owns no bodies; keeps its memory from island to island.
class ContactIsland {
 public:
  using Twist = Eigen::Matrix<double, 6, 1>;
  struct Point {
    ConstraintPoint* p = nullptr;
    Vector rho;                    ///< m, in the frame n, t1, t2, from the manifold's centre
    double K = 0;                  ///< 1/kg, along n
    double gap = 0;                ///< m: ConstraintPoint::gap
    double R = 0;                  ///< 1/kg: what it yields by
    double target = 0;             ///< m/s: un is to be no less
    double slip = 0;               ///< m/s: mu |ut| as it was taken to be
    Vector held = Vector::Zero();  ///< N s: the impulse at u = (target - slip, 0, 0)
    Vector g = Vector::Zero();     ///< N s: the impulse at the last gradient
    Vector u = Vector::Zero(), du = Vector::Zero();  ///< m/s: velocity; its change along a way
  };

  /// The bodies of these slots, with the velocities that they have after loads.
  /// `is_flat`: a manifold's points act in one plane, as in the soft step (contact_method.h).
  void begin(const BodyLines& bodies, const BodyArrays& arrays, std::span<const std::int32_t> slots,
             std::span<ContactConstraint* const> constraints, bool is_flat);

  std::size_t bodies() const { return bodies_.size(); }
  Eigen::Index unknowns() const { return static_cast<Eigen::Index>(6 * bodies()); }
  std::span<const Point> points() const { return points_; }
  std::span<Point> points() { return points_; }
  void restore(std::span<const Point> points) { points_.assign(points.begin(), points.end()); }
  /// For each point with its contact.
  template <class F>
  void for_points(F&& f) {
    for (Manifold& m : manifolds_) {
      for (Point& point : of(m)) f(point, *m.c);
    }
  }

  /// Unknowns of velocities: those before and after loads, without contacts.
  const Eigen::VectorXd& before() const { return before_; }
  const Eigen::VectorXd& free() const { return free_; }
  /// Velocities of the unknowns, for the line of a body.
  void store(const Eigen::VectorXd& x, std::span<BodyLine> lines) const;

  /// m/s, of the k-th body: its v, and its w by its radius of gyration.
  double speed(const Eigen::VectorXd& x, std::size_t k) const;

  /// R of all points by their K.
  void set_yield(double R);

  // By the velocities `x`: u of all points.
  void look(const Eigen::VectorXd& x);
  void look_along(const Eigen::VectorXd& d);
  void go(double part);  ///< u += part du
  /// x - free - J^T g: 0 at the minimum. Sets g.
  void gradient(const Eigen::VectorXd& x, Eigen::VectorXd& r);
  /// Its product with d, at x + part d, but for what bodies add.
  double slope_of_contacts(double part) const;
  /// The Hessian, I + J^T G J. `is_cold`: points that nearly touch are taken to stick.
  void assemble(BlockCholesky& H, bool is_cold);

 private:
  struct Body {
    std::int32_t line;
    double root_mass;  // sqrt(m)
    Matrix S, inverse_S;
    bool turns;
  };
  /// From a body's unknowns to the twist at the manifold's centre, in its frame.
  struct Side {
    std::int32_t body = -1;  // or -1: does not yield
    double share = 0;        // 1 / sqrt(m)
    Matrix lever, turn;
  };
  struct Manifold {
    ContactConstraint* c;
    Matrix frame;  // rows n, t1, t2
    Side A, B;
    Twist driven;  // by bodies that do not yield
    std::size_t first, count;
  };

  std::span<Point> of(const Manifold& m) { return std::span(points_).subspan(m.first, m.count); }
  std::span<const Point> of(const Manifold& m) const {
    return std::span(points_).subspan(m.first, m.count);
  }
  void add_body(const BodyLines& bodies, const BodyArrays& arrays, std::int32_t slot);
  void add_manifold(const BodyLines& bodies, ContactConstraint& c);
  Side side(const BodyLines& bodies, std::int32_t slot, const Vector& arm, const Rotation& turn,
            const Manifold& m, Twist& driven, double sign) const;
  Twist twist(const Manifold& m, const Eigen::VectorXd& x) const;
  static void add_wrench(const Manifold& m, const Side& side, const Vector& F, const Vector& T,
                         double sign, Eigen::VectorXd& r);
  bool acts(const Manifold& m, bool is_cold) const;
  BlockCholesky::Block stiffness(const Manifold& m, bool is_cold) const;

  bool is_flat_ = false;
  std::vector<Body> bodies_;
  std::vector<std::int32_t> number_;  // by line: of the island's bodies
  std::vector<Manifold> manifolds_;
  std::vector<Point> points_;
  std::vector<BlockPair> pairs_;
  std::vector<std::size_t> active_;
  Eigen::VectorXd before_, free_;
};

}  // namespace cradle
