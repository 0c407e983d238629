#include "server/world/body_table.h"

#include <algorithm>
#include <cstring>

#include "server/dynamics/rotation.h"

namespace cradle {

std::optional<std::size_t> BodyTable::slot(BodyId body) const {
  const auto found = std::lower_bound(id.begin(), id.end(), body.value);
  if (found == id.end() || *found != body.value) return std::nullopt;
  return static_cast<std::size_t>(found - id.begin());
}

void BodyTable::append(std::int64_t new_id, const BodySpec& spec,
                       const MassProperties& mass_properties) {
  NameBytes name_bytes{};
  std::memcpy(name_bytes.data(), spec.name.data(),
              std::min(spec.name.size(), name_bytes.size() - 1));
  const bool moves = spec.kind != BodyKind::fixed;
  id.push_back(new_id);
  kind.push_back(spec.kind);
  shape.push_back(spec.shape);
  material.push_back(spec.material);
  contact_tolerance.push_back(spec.contact_tolerance_m);
  name.push_back(name_bytes);
  mass.push_back(mass_properties.mass_kg);
  inverse_mass.push_back(mass_properties.inverse_mass);
  inertia.push_back(mass_properties.inertia_kgm2);
  inverse_inertia.push_back(mass_properties.inverse_inertia);
  p_BoBcm.push_back(mass_properties.p_BoBcm);
  q_BP.push_back(mass_properties.q_BP);
  is_offset.push_back(mass_properties.is_offset ? 1 : 0);
  x.emplace_back();
  x_rest.emplace_back();
  q.emplace_back();
  place(id.size() - 1, {to_eigen(spec.p_WBo), normalised(to_eigen(spec.q_WB))});
  v.push_back(moves ? to_eigen(spec.v_WBcm) : Vector(Vector::Zero()));
  w.push_back(moves ? to_eigen(spec.w_WB) : Vector(Vector::Zero()));
  drag.emplace_back();
  in_contact.push_back(0);
  quarantined.push_back(0);
  still.push_back(0);
  island.push_back(0);
  still_x.push_back(x.back());
  still_q.push_back(q.back());
  sway.emplace_back();
  poise.emplace_back();
}

void BodyTable::remove(const std::vector<std::uint8_t>& is_removed) {
  for_each_array([&](const char*, auto& array) { remove_slots(is_removed, array); });
}

}  // namespace cradle
