#include "server/scene_lattice.h"

#include <cmath>
#include <random>

namespace cradle {
namespace {

Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }

class Random {
 public:
  explicit Random(std::int64_t seed) : bits_(static_cast<std::uint64_t>(seed)) {}

  /// Uniform in -1 <= u < 1, a multiple of 2^-52.
  double symmetric() { return 2 * (static_cast<double>(bits_() >> 11) * 0x1p-53) - 1; }

  /// Uniform in the box of half extents `bound`; zero, and nothing drawn, without one.
  Vec3 in_box(const std::optional<Vec3>& bound) {
    if (!bound) return {};
    const double x = symmetric(), y = symmetric(), z = symmetric();
    return {bound->x * x, bound->y * y, bound->z * z};
  }

  /// Uniform among rotations: the direction of a point in the unit ball of four dimensions.
  Quat rotation() {
    for (;;) {
      const double w = symmetric(), x = symmetric(), y = symmetric(), z = symmetric();
      const double squared_norm = w * w + x * x + y * y + z * z;
      if (squared_norm > 1 || squared_norm == 0) continue;
      const double norm = std::sqrt(squared_norm);
      return {w / norm, x / norm, y / norm, z / norm};
    }
  }

 private:
  std::mt19937_64 bits_;
};

/// Of the lattice point (i, j, k). Halves are exact, so a tapered layer stays centred.
Vec3 point_of(const Lattice& lattice, std::int64_t i, std::int64_t j, std::int64_t k) {
  const auto steps = [k](std::int64_t n, std::int64_t taper) {
    return static_cast<double>(n) + 0.5 * static_cast<double>(taper * k);
  };
  const Vec3 offset{lattice.pitch_m.x * steps(i, lattice.taper[0]),
                    lattice.pitch_m.y * steps(j, lattice.taper[1]),
                    lattice.pitch_m.z * static_cast<double>(k)};
  return lattice.origin_m + offset;
}

}  // namespace

std::vector<BodySpec> bodies_of(const Lattice& lattice) {
  std::vector<BodySpec> bodies;
  Random random(lattice.seed);
  for (std::int64_t k = 0; k < lattice.count[2]; ++k) {
    for (std::int64_t j = 0; j < lattice.count[1] - lattice.taper[1] * k; ++j) {
      for (std::int64_t i = 0; i < lattice.count[0] - lattice.taper[0] * k; ++i) {
        BodySpec body = lattice.bodies[bodies.size() % lattice.bodies.size()];
        const Vec3 jitter = random.in_box(lattice.jitter_m);
        body.p_WBo = point_of(lattice, i, j, k) + body.p_WBo + jitter;
        if (lattice.random_orientation) body.q_WB = random.rotation();
        body.v_WBcm = body.v_WBcm + random.in_box(lattice.velocity_jitter_mps);
        body.w_WB = body.w_WB + random.in_box(lattice.angular_velocity_jitter_radps);
        bodies.push_back(body);
      }
    }
  }
  return bodies;
}

}  // namespace cradle
