/// Impacts with restitution inside a sub-step, each at its time: see impacts.cpp.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/dynamics/contact/body_lines.h"
#include "server/dynamics/contact/contact_constraint.h"
#include "server/dynamics/impact/reflections.h"

namespace cradle {

/// Of one batch of bodies and contacts in one tick; keeps its memory.
class Impacts {
 public:
  /// Contacts with restitution alone take part.
  void begin(std::span<ContactConstraint* const> constraints, const BodyLines& bodies);
  bool is_empty() const { return points_.empty(); }
  /// Sets since begin() with more contacts than are solved at once: one after the other.
  int ordered() const { return ordered_; }
  /// Whereto it adds what it does to energy and momentum, until the next call; null: nowhere.
  void keep_balance(ContactBalance* balance) { balance_ = balance; }
  /// At a sub-step's start, before its loads: bodies that will hit others in it get the velocities
  /// that they will have then, and the places from where these lead to where they will be.
  void strike(BodyLines& bodies, double h);

 private:
  /// One body's part in a point: its normal velocity is n . v + along . w, and an impulse turns the
  /// body's line by `turn` (1/(kg m)).
  struct Side {
    std::int32_t line;
    double inverse_mass;
    Vector along, turn;
  };
  struct Point {
    ContactConstraint* c;
    ConstraintPoint* p;
    Side A, B;
    double impulse;  // N s, of the set that is struck
    bool is_struck;
  };
  struct Due {
    double time;
    std::int32_t point;
    int hits_a, hits_b;  // of the bodies when it was foreseen
  };
  /// A body of the set that is struck.
  struct Struck {
    std::int32_t line;
    Vector v, w;      // at the sub-step's start, before
    BodyLine motion;  // at the time of the impact
  };

  Side side(const ContactConstraint& c, std::int32_t line, const Rotation& turn,
            double inverse_mass, const Matrix& inverse_inertia, const Vector& r,
            const BodyLines& bodies) const;
  void link(std::size_t lines);
  static bool is_later(const Due& one, const Due& other);
  void foresee(std::int32_t point, double now);
  void strike_set(std::int32_t first, double t);
  void take_point(std::int32_t point, double t);
  void take(std::int32_t line, double t);
  bool add_violated(double t);
  void reflect_set();
  void reflect_in_order();
  void rub(Point& point);
  void release(double t);
  double slow(const Point& point) const;
  double pull(const Point& point) const;
  double normal_velocity(const Point& point) const;
  double separation(const Point& point, double t) const;
  double coupling(const Point& one, const Point& other) const;
  void push(const Side& side, double impulse, const Vector& n);
  void push_back(const Vector& impulse, double work);
  void push(Point& point, double impulse);

  BodyLines* bodies_ = nullptr;
  ContactBalance* balance_ = nullptr;
  double h_ = 0;
  int ordered_ = 0;
  std::vector<Point> points_;
  std::vector<std::int32_t> first_, next_;  // points by line, linked: twice the point plus the side
  std::vector<int> hits_;                   // by line, in this tick
  std::vector<Due> due_;                    // a heap
  std::vector<Struck> struck_;
  std::vector<std::int32_t> place_;  // by line: in struck_, or -1
  std::vector<std::int32_t> set_;    // points that are struck
};

}  // namespace cradle
