// Flat bodies: closed forms, and the moment J_z of the solids they are sections of.
#include "server/dynamics/planar_mass.h"

#include <catch2/catch.hpp>

#include "tests/physics/solids.h"

namespace cradle {
namespace {

using Polygon = std::vector<PlanarVector>;

Polygon regular(int n, double r) {
  Polygon p;
  for (int k = 0; k < n; ++k) {
    p.emplace_back(r * std::cos(2 * kPi * k / n), r * std::sin(2 * kPi * k / n));
  }
  return p;
}

void check_same_planar(const PlanarMass& a, const PlanarMass& b, double tolerance) {
  CHECK(a.mass_kg == Approx(b.mass_kg).epsilon(tolerance));
  CHECK((a.p_BoBcm - b.p_BoBcm).norm() < tolerance);
  CHECK(a.inertia_kgm2 == Approx(b.inertia_kgm2).epsilon(tolerance));
}

/// An L of 2 by 2 m whose legs are 1 m wide: three squares.
const Polygon kAngle{{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};

}  // namespace

TEST_CASE("flat bodies have the mass and moment of their closed forms") {
  check_same_planar(planar_circle(2, 3), {12 * kPi, {0, 0}, 24 * kPi}, 1e-14);
  // A rectangle of a by b: m (a^2 + b^2) / 12. A regular n-gon: m r^2 (1 + 2 cos^2(pi/n)) / 6.
  check_same_planar(planar_polygon(Polygon{{1, 1}, {5, 1}, {5, 4}, {1, 4}}, 2).mass,
                    {24, {3, 2.5}, 24 * 25.0 / 12}, 1e-14);
  for (const int n : {3, 4, 5, 17}) {
    const double area = 0.5 * n * 4 * std::sin(2 * kPi / n), c = std::cos(kPi / n);
    check_same_planar(planar_polygon(regular(n, 2), 1).mass,
                      {area, {0, 0}, area * 4 * (1 + 2 * c * c) / 6}, 1e-14);
  }
  // Three squares of 1 kg, each m/6 about itself, centres at (1/2, 1/2), (3/2, 1/2), (1/2, 3/2).
  check_same_planar(planar_polygon(kAngle, 1).mass,
                    {3, {5.0 / 6, 5.0 / 6}, 3.0 / 6 + 2.0 / 9 + 2 * 5.0 / 9}, 1e-14);
}

TEST_CASE("a flat body is a section of a cylinder, a box or a prism") {
  const double r = 0.6, L = 0.8;
  CHECK(planar_circle(r, 1).inertia_kgm2 / planar_circle(r, 1).mass_kg ==
        Approx(mass_distribution(Shape::cylinder(r, 9), 1).G(2, 2)).epsilon(1e-14));
  // The capsule from its outline: half circles of n edges each.
  std::vector<double> errors;
  for (const int n : {16, 32, 64}) {
    Polygon outline;
    for (const int end : {1, -1}) {
      for (int k = 0; k <= n; ++k) {
        const double u = kPi * k / n - kPi / 2;
        outline.emplace_back(end * (L + r * std::cos(u)), end * r * std::sin(u));
      }
    }
    const PlanarMass m = planar_polygon(outline, 5).mass;
    errors.push_back(m.inertia_kgm2 / planar_capsule(r, L, 5).inertia_kgm2 - 1);
    CHECK(m.mass_kg == Approx(planar_capsule(r, L, 5).mass_kg).epsilon(2.0 / n / n));
  }
  CHECK(std::log2(errors[0] / errors[1]) == Approx(2).margin(0.05));
  CHECK(std::log2(errors[1] / errors[2]) == Approx(2).margin(0.05));
  CHECK(std::abs(errors[2]) < 1e-3);
}

TEST_CASE("parallel axis, turning and another mass act on flat bodies as on solids") {
  const PlanarMass square = planar_polygon(Polygon{{0, 0}, {1, 0}, {1, 1}, {0, 1}}, 1).mass;
  const std::array parts{square, posed(square, {1, 0}, 0), posed(square, {1, 1}, kPi / 2)};
  check_same_planar(sum(parts), planar_polygon(kAngle, 1).mass, 1e-14);
  CHECK(sum(std::span<const PlanarMass>()).mass_kg == 0);
  const PlanarMass heavy = with_mass(square, 12);
  CHECK(heavy.mass_kg == 12);
  CHECK(heavy.inertia_kgm2 == Approx(2).epsilon(1e-14));
  Polygon far = kAngle;
  for (PlanarVector& p : far) p += PlanarVector(1e4, -2e4);
  CHECK(planar_polygon(far, 1).mass.inertia_kgm2 ==
        Approx(planar_polygon(kAngle, 1).mass.inertia_kgm2).epsilon(1e-11));
}

TEST_CASE("what is no polygon is refused with its reason") {
  using Catch::Matchers::Contains;
  const auto fault = [](const Polygon& p, double density = 1) {
    return planar_polygon(p, density).fault;
  };
  CHECK(fault(kAngle).empty());
  CHECK_THAT(fault({{0, 0}, {1, 0}}), Contains("three corners"));
  CHECK_THAT(fault(Polygon(5000, {0, 0})), Contains("too many"));
  CHECK_THAT(fault({kAngle.rbegin(), kAngle.rend()}), Contains("clockwise"));
  CHECK_THAT(fault({{0, 0}, {2, 2}, {2, 0}, {0, 1.5}}), Contains("meets itself"));  // a bow tie
  CHECK_THAT(fault({{0, 0}, {3, 0}, {3, 2}, {1, 0}, {0, 2}}), Contains("meets itself"));  // touches
  CHECK_THAT(fault({{0, 0}, {2, 0}, {1, 0}, {1, 1}}), Contains("meets itself"));  // folds back
  CHECK_THAT(fault({{0, 0}, {1, 1}, {2, 2}}), Contains("no area"));
  CHECK_THAT(fault({{0, 0}, {1, 0}, {0, std::nan("")}}), Contains("not finite"));
  for (const double bad : {0.0, -1.0, std::nan("")}) {
    CHECK_THAT(fault(kAngle, bad), Contains("density"));
  }
}

}  // namespace cradle
