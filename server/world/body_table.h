/// The bodies' state: one array a quantity, one slot a body, in the order of creation.
///
/// Ids grow with creation, so slots are sorted by id. Removing bodies closes the gaps: slots
/// change, ids do not. Only the world indexes these arrays.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "server/collision/geometry.h"
#include "server/dynamics/mass_properties.h"

namespace cradle {

using NameBytes = std::array<char, 32>;  ///< zero padded

struct BodyTable {
  std::vector<std::int64_t> id;
  std::vector<BodyKind> kind;
  std::vector<Shape> shape;
  std::vector<Material> material;
  std::vector<NameBytes> name;
  std::vector<double> mass;  ///< kg; 0 for bodies that do not yield
  std::vector<double> inverse_mass;
  std::vector<Vector> inertia;  ///< principal moments J in B, kg m^2
  std::vector<Vector> inverse_inertia;
  std::vector<Vector> x;                  ///< m, in W; Bo and Bcm are the same point
  std::vector<Rotation> q;                ///< q_WB
  std::vector<Vector> v;                  ///< m/s, in W
  std::vector<Vector> w;                  ///< rad/s, in W
  std::vector<std::uint8_t> in_contact;   ///< in the last tick
  std::vector<std::uint8_t> quarantined;  ///< neither moved nor collided with

  std::size_t size() const { return id.size(); }

  /// Calls `f(name, array)` for every array above.
  template <class F>
  void for_each_array(F&& f) {
    f("id", id);
    f("kind", kind);
    f("shape", shape);
    f("material", material);
    f("name", name);
    f("mass", mass);
    f("inverse_mass", inverse_mass);
    f("inertia", inertia);
    f("inverse_inertia", inverse_inertia);
    f("x", x);
    f("q", q);
    f("v", v);
    f("w", w);
    f("in_contact", in_contact);
    f("quarantined", quarantined);
  }

  /// Where the body is, if it exists.
  std::optional<std::size_t> slot(BodyId body) const;

  /// Adds a body at the end. `new_id` must be larger than all before.
  void append(std::int64_t new_id, const BodySpec& spec, const MassProperties& mass_properties);

  /// Removes the slots whose flag is not zero; the others keep their order.
  void remove(const std::vector<std::uint8_t>& is_removed);

  bool is_moving(std::size_t i) const {
    return kind[i] == BodyKind::dynamic && quarantined[i] == 0;
  }
  std::string_view name_text(std::size_t i) const { return name[i].data(); }
};

}  // namespace cradle
