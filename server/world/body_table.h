/// The bodies' state: one array a quantity, one slot a body, in the order of creation.
///
/// Ids grow with creation, so slots are sorted by id. Removing bodies closes the gaps: slots
/// change, ids do not. Only the world indexes these arrays.
///
/// What moves is the frame P of a body: its origin is the centre of mass Bcm, its axes are
/// principal. Users and shapes have the frame B, which is fixed in P, and for most bodies the same:
/// `frame` and `place` go from one to the other.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "server/collision/geometry.h"
#include "server/dynamics/contact/contact_constraint.h"
#include "server/dynamics/loads.h"
#include "server/dynamics/mass_properties.h"

namespace cradle {

using NameBytes = std::array<char, 32>;  ///< zero padded

/// Removes the slots whose flag is not zero; the others keep their order.
template <class T>
void remove_slots(const std::vector<std::uint8_t>& is_removed, std::vector<T>& by_slot) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < by_slot.size(); ++i) {
    if (is_removed[i] == 0) by_slot[kept++] = by_slot[i];
  }
  by_slot.resize(kept);
}

/// A body as users see it.
struct BodyFrame {
  Vector p_WBo;  ///< m
  Rotation q_WB;
};

struct BodyTable {
  std::vector<std::int64_t> id;
  std::vector<BodyKind> kind;
  std::vector<Shape> shape;
  std::vector<Material> material;
  std::vector<double> contact_tolerance;  ///< m, of its own; 0: none
  std::vector<NameBytes> name;
  std::vector<double> mass;  ///< kg; 0 for bodies that do not yield
  std::vector<double> inverse_mass;
  std::vector<Vector> inertia;  ///< principal moments J in P, kg m^2
  std::vector<Vector> inverse_inertia;
  std::vector<Vector> p_BoBcm;          ///< m, in B
  std::vector<Rotation> q_BP;           ///< turns vectors of P into B
  std::vector<std::uint8_t> is_offset;  ///< P is not B: p_BoBcm or q_BP says more than nothing
  std::vector<Vector> x;                ///< Bcm, m, in W
  std::vector<Vector> x_rest;           ///< m: what rounding has left out of x, in contact
  std::vector<Rotation> q;              ///< q_WP
  std::vector<Vector> v;                ///< m/s, in W
  std::vector<Vector> w;                ///< rad/s, in W
  std::vector<Drag> drag;
  std::vector<std::uint8_t> in_contact;   ///< in the last tick
  std::vector<std::uint8_t> quarantined;  ///< neither moved nor collided with
  std::vector<std::int32_t> still;  ///< ticks since it went anywhere: see sleeping.h; of bodies
                                    ///< that are not dynamic 0 in the tick after a command
  std::vector<std::int64_t>
      island;                   ///< of sleepers: id of the first body that sleeps with it; or 0
  std::vector<Vector> still_x;  ///< where it has been still
  std::vector<Rotation> still_q;
  std::vector<Sway> sway;
  std::vector<Poise> poise;

  std::size_t size() const { return id.size(); }

  /// Calls `f(name, array)` for every array above.
  template <class F>
  void for_each_array(F&& f) {
    f("id", id);
    f("kind", kind);
    f("shape", shape);
    f("material", material);
    f("contact_tolerance", contact_tolerance);
    f("name", name);
    f("mass", mass);
    f("inverse_mass", inverse_mass);
    f("inertia", inertia);
    f("inverse_inertia", inverse_inertia);
    f("p_BoBcm", p_BoBcm);
    f("q_BP", q_BP);
    f("is_offset", is_offset);
    f("x", x);
    f("x_rest", x_rest);
    f("q", q);
    f("v", v);
    f("w", w);
    f("drag", drag);
    f("in_contact", in_contact);
    f("quarantined", quarantined);
    f("still", still);
    f("island", island);
    f("still_x", still_x);
    f("still_q", still_q);
    f("sway", sway);
    f("poise", poise);
  }

  /// Where the body is, if it exists.
  std::optional<std::size_t> slot(BodyId body) const;

  /// Adds a body at the end. `new_id` must be larger than all before.
  void append(std::int64_t new_id, const BodySpec& spec, const MassProperties& mass_properties);

  /// Removes the slots whose flag is not zero; the others keep their order.
  void remove(const std::vector<std::uint8_t>& is_removed);

  /// Where Bo and B are.
  BodyFrame frame(std::size_t i) const {
    if (is_offset[i] == 0) return {x[i], q[i]};
    // A product with no turn would do, but for the signs of zeros in a planar world.
    const Rotation q_WB = q_BP[i].w() == 1 ? q[i] : q[i] * q_BP[i].conjugate();
    return {x[i] - q_WB * p_BoBcm[i], q_WB};
  }
  /// Puts Bo and B there; `B.q_WB` has unit length.
  void place(std::size_t i, const BodyFrame& B) {
    x[i] = is_offset[i] == 0 ? B.p_WBo : Vector(B.p_WBo + B.q_WB * p_BoBcm[i]);
    x_rest[i].setZero();
    q[i] = is_offset[i] == 0 ? B.q_WB : B.q_WB * q_BP[i];
  }

  bool is_moving(std::size_t i) const {
    return kind[i] == BodyKind::dynamic && quarantined[i] == 0;
  }
  bool is_asleep(std::size_t i) const { return island[i] != 0; }
  std::string_view name_text(std::size_t i) const { return name[i].data(); }
};

}  // namespace cradle
