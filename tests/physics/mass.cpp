// Mass, centre of mass and inertia: primitives against closed forms and against meshes of them,
// polyhedra against closed forms, sums against a second method.
#include <catch2/catch.hpp>

#include "server/dynamics/mass_properties.h"
#include "tests/bench/poses.h"
#include "tests/physics/solids.h"

namespace cradle {
namespace {

void check_same(const MassDistribution& a, const MassDistribution& b, double tolerance) {
  CHECK(std::abs(a.mass_kg / b.mass_kg - 1) < tolerance);
  CHECK((a.p_BoBcm - b.p_BoBcm).norm() < tolerance * (1 + b.p_BoBcm.norm()));
  CHECK(relative(a.G, b.G) < tolerance);
}

/// A half circle as a chain from the lower pole to the upper, of `n` edges.
std::vector<std::pair<double, double>> half_circle(int n, double r) {
  std::vector<std::pair<double, double>> chain;
  for (int k = 0; k <= n; ++k) {
    chain.emplace_back(r * std::sin(kPi * k / n), -r * std::cos(kPi * k / n));
  }
  return chain;
}

/// The surface of a round shape by 4 n^2 or so triangles.
Surface surface_of(const Shape& shape, int n) {
  const double r = shape.parameters[0], L = shape.parameters[1];
  switch (shape.kind) {
    case ShapeKind::cylinder:
      return turned_surface({{0, -L}, {r, -L}, {r, L}, {0, L}}, 4 * n);
    case ShapeKind::cone:
      return turned_surface({{0, -L}, {r, -L}, {0, L}}, 4 * n);
    case ShapeKind::capsule: {
      auto chain = half_circle(2 * n, r);  // an even number: one ring at the equator, doubled
      for (std::size_t k = 0; k < chain.size(); ++k) {
        chain[k].second += k <= chain.size() / 2 ? -L : L;
      }
      chain.insert(chain.begin() + n + 1, {r, L});
      return turned_surface(chain, 4 * n);
    }
    case ShapeKind::ellipsoid: {
      Surface s = turned_surface(half_circle(2 * n, 1), 4 * n);
      for (Vector& v : s.vertices) v = v.cwiseProduct(to_eigen(shape.half_extents_m()));
      return s;
    }
    default:
      return turned_surface(half_circle(2 * n, r), 4 * n);
  }
}

Vector diagonal(double x, double y, double z) { return {x, y, z}; }

/// Parts of every kind, posed and of different density.
std::vector<CompoundPart> mixed_parts() {
  const Rotation slant(Eigen::AngleAxisd(0.7, Vector(1, 2, 3).normalized()));
  CompoundPart box{Shape::box({0.3, 0.4, 0.5}), nullptr, {1, 0.2, -0.1}, slant, 700};
  CompoundPart ball{Shape::sphere(0.45), nullptr, {-0.4, 0.3, 0.9}, Rotation::Identity(), 2000};
  CompoundPart rod{Shape::cylinder(0.2, 0.8), nullptr, {0, -0.8, 0}, slant.conjugate(), 1200};
  CompoundPart hull{{ShapeKind::hull, {}},
                    make_hull(octahedron_surface(0.7).vertices).geometry,
                    {-1, -1, -1},
                    slant,
                    900};
  return {box, ball, rod, hull};
}

}  // namespace

TEST_CASE("every primitive has the mass and moments of its closed form") {
  const auto check = [](const Shape& shape, double volume, const Vector& moments_per_kg,
                        const Vector& centre = Vector::Zero()) {
    CAPTURE(static_cast<int>(shape.kind));
    const MassDistribution m = mass_distribution(shape, 3);
    CHECK(m.mass_kg == Approx(3 * volume).epsilon(1e-14));
    CHECK((m.p_BoBcm - centre).norm() < 1e-15);
    CHECK(relative(m.G, moments_per_kg.asDiagonal()) < 1e-14);
  };
  check(Shape::sphere(2), 32 * kPi / 3, diagonal(1.6, 1.6, 1.6));
  check(Shape::box({1, 2, 3}), 48, diagonal(13.0 / 3, 10.0 / 3, 5.0 / 3));
  check(Shape::ellipsoid({1, 2, 3}), 8 * kPi, diagonal(13.0 / 5, 2, 1));
  check(Shape::cylinder(2, 3), 24 * kPi, diagonal(4, 4, 2));
  // Height 6: V = pi r^2 h / 3; 3/20 r^2 + 3/80 h^2 across, 3/10 r^2 along; h/4 above its base.
  check(Shape::cone(2, 3), 8 * kPi, diagonal(1.95, 1.95, 1.2), {0, 0, -1.5});
  // Tube 24 pi, ball 32/3 pi: weights 9/13 and 4/13; the half balls' centres at L + 3/8 r.
  const double across = 9.0 / 13 * 4 + 4.0 / 13 * (1.6 - 4 * 9.0 / 64 + 3.75 * 3.75);
  check(Shape::capsule(2, 3), (24 + 32.0 / 3) * kPi,
        diagonal(across, across, 9.0 / 13 * 2 + 4.0 / 13 * 1.6));
}

TEST_CASE("meshes of round shapes converge to them with the square of their fineness") {
  for (const Shape& shape :
       {Shape::sphere(0.7), Shape::capsule(0.3, 0.8), Shape::cylinder(0.4, 0.3),
        Shape::cone(0.6, 0.9), Shape::ellipsoid({0.3, 0.5, 0.9})}) {
    CAPTURE(static_cast<int>(shape.kind));
    const MassDistribution exact = mass_distribution(shape, 5);
    std::vector<double> errors;
    for (const int n : {10, 20, 40}) {
      const MassDistribution m = mass_of(mesh_of(surface_of(shape, n)), 5);
      CHECK((m.p_BoBcm - exact.p_BoBcm).norm() < 1e-13);
      errors.push_back(relative(m.inertia_kgm2(), exact.inertia_kgm2()));
    }
    CHECK(errors[2] < 5e-3);
    CHECK(std::log2(errors[0] / errors[1]) == Approx(2).margin(0.05));
    CHECK(std::log2(errors[1] / errors[2]) == Approx(2).margin(0.05));
  }
}

TEST_CASE("P05: polyhedra are exact, wherever they are and however they are turned") {
  // Tetrahedron of the origin and the unit vectors: V = 1/6, centre (1, 1, 1)/4, and the integrals
  // of x^2 and x y over it are 1/60 and 1/120. Octahedron |x| + |y| + |z| <= a: V = 4/3 a^3, a^2/5
  // each.
  MassDistribution tetrahedron{1.0 / 6, Vector::Constant(0.25), Matrix::Zero()};
  const double square = 1.0 / 10 - 1.0 / 16, product = 1.0 / 20 - 1.0 / 16;
  tetrahedron.G.setConstant(-product);
  tetrahedron.G.diagonal().setConstant(2 * square);
  const double a = 1.5;
  const MassDistribution octahedron{4.0 / 3 * a * a * a, Vector::Zero(),
                                    a * a / 5 * Matrix::Identity()};
  const Matrix R = turn(2.1, {3, -1, 2});
  for (const auto& [surface, exact] :
       {std::pair{box_surface({1, 2, 3}), mass_distribution(Shape::box({1, 2, 3}), 1)},
        {tetrahedron_surface(), tetrahedron},
        {octahedron_surface(a), octahedron}}) {
    check_same(mass_of(mesh_of(surface)), exact, 1e-14);
    check_same(mass_of(make_hull(surface.vertices)), exact, 1e-14);
    const Vector far(10, 20, 30);
    const MassDistribution turned{exact.mass_kg, far + R * exact.p_BoBcm,
                                  R * exact.G * R.transpose()};
    check_same(mass_of(mesh_of(moved(surface, far, R))), turned, 1e-12);
    check_same(mass_of(make_hull(moved(surface, far, R).vertices)), turned, 1e-12);
  }
}

TEST_CASE("P04: density, mass and inertia of a box, and what overrides them") {
  BodySpec spec;
  spec.shape = Shape::box({1, 2, 3});
  spec.density_kgpm3 = 1234;
  MassProperties p;
  const auto read = [&] {
    REQUIRE(mass_properties(spec, nullptr, p) == Result::ok);
    CHECK(p.inverse_mass == 1 / p.mass_kg);
    CHECK(p.inverse_inertia == p.inertia_kgm2.cwiseInverse());
    return p.inertia_kgm2;
  };
  const Vector unit = Vector(52, 40, 20) / 12;
  CHECK((read() - 59232 * unit).norm() < 1e-9);
  CHECK(p.mass_kg == 59232);
  CHECK_FALSE(p.is_offset);
  spec.mass_kg = 2;  // scales the moments
  CHECK((read() - 2 * unit).norm() < 1e-14);
  spec.mass_kg = 13;
  spec.inertia_kgm2 = {3, 2, 1};  // replaces them
  CHECK(read() == Vector(3, 2, 1));
  CHECK_FALSE(p.is_offset);

  // The same moments turned by 0.1 pi about (1, 1, 1), as a tensor with products.
  const Matrix R = turn(0.1 * kPi, {1, 1, 1});
  const Matrix J = R * Vector(3, 2, 1).asDiagonal() * R.transpose();
  spec.inertia_kgm2 = to_plain(Vector(J.diagonal()));
  spec.inertia_products_kgm2 = {J(0, 1), J(0, 2), J(1, 2)};
  CHECK((read() - Vector(3, 2, 1)).norm() < 1e-14);
  CHECK(p.is_offset);
  CHECK((p.q_BP.toRotationMatrix() - R).norm() < 1e-14);
  CHECK(p.p_BoBcm == Vector::Zero());

  spec.sets_centre_of_mass = true;  // moves the mass, keeps the moments about it
  spec.p_BoBcm = {0.1, 0.2, -0.3};
  CHECK((read() - Vector(3, 2, 1)).norm() < 1e-14);
  CHECK(p.p_BoBcm == Vector(0.1, 0.2, -0.3));

  spec.kind = BodyKind::kinematic;  // infinite, about Bo
  REQUIRE(mass_properties(spec, nullptr, p) == Result::ok);
  CHECK(p.inverse_mass == 0);
  CHECK_FALSE(p.is_offset);
}

TEST_CASE("a torus of triangles agrees with the sum over its slices, and tends to the torus") {
  // By hand for the polygon turned by straight chords: each of the n sectors is a prism-like body
  // between two planes through z, cut here into thin slices at constant z. In the limit of the
  // torus: V = 2 pi^2 R r^2, J_z = R^2 + 3/4 r^2, J_x = R^2/2 + 5/8 r^2 a kilogram.
  const double R = 2, r = 0.5;
  const MassDistribution exact{
      2 * kPi * kPi * R * r * r, Vector::Zero(),
      diagonal(R * R / 2 + 5 * r * r / 8, R * R / 2 + 5 * r * r / 8, R * R + 3 * r * r / 4)
          .asDiagonal()};
  std::vector<double> errors;
  for (const int n : {16, 32, 64}) {
    const MassDistribution m = mass_of(mesh_of(torus_surface(R, r, 2 * n, n)));
    CHECK(m.p_BoBcm.norm() < 1e-13);
    errors.push_back(relative(m.inertia_kgm2(), exact.inertia_kgm2()));
  }
  CHECK(std::log2(errors[0] / errors[1]) == Approx(2).margin(0.05));
  CHECK(std::log2(errors[1] / errors[2]) == Approx(2).margin(0.05));

  // A square ring of square section with its corners on the axes, n = m = 4, as a difference of
  // boxes turned by 45 degrees is not one; so the ring of box sections instead: outer minus inner.
  Surface ring = box_surface({2, 2, 1});
  Surface hole = box_surface({1, 1, 0.5});
  for (Triangle& t : hole.triangles) {
    std::swap(t[1], t[2]);
    for (auto& v : t) v += 8;
  }
  ring.vertices.insert(ring.vertices.end(), hole.vertices.begin(), hole.vertices.end());
  ring.triangles.insert(ring.triangles.end(), hole.triangles.begin(), hole.triangles.end());
  const MadeGeometry hollow = mesh_of(ring);
  REQUIRE(hollow.geometry);
  const Matrix outer = mass_distribution(Shape::box({2, 2, 1}), 1).inertia_kgm2();
  const Matrix inner = mass_distribution(Shape::box({1, 1, 0.5}), 1).inertia_kgm2();
  CHECK(mass_of(hollow).mass_kg == Approx(32 - 4).epsilon(1e-14));
  CHECK(relative(mass_of(hollow).inertia_kgm2(), outer - inner) < 1e-14);
}

TEST_CASE("a compound is the sum over its parts, by parallel axes and by sampling") {
  const std::vector<CompoundPart> parts = mixed_parts();
  const MassDistribution m = mass_of(make_compound(parts));

  // The moments about an axis through Bo, part by part: J_o = J_c + m (|d|^2 1 - d d^T), E5 of the
  // seed paper's errata; and then back to the centre of mass of all.
  double mass = 0;
  Vector first = Vector::Zero();
  Matrix J_o = Matrix::Zero();
  for (const CompoundPart& part : parts) {
    const MassDistribution own = part.geometry
                                     ? mass_distribution(*part.geometry, part.density_kgpm3)
                                     : mass_distribution(part.shape, part.density_kgpm3);
    const Matrix R = part.q_BP.toRotationMatrix();
    const Vector d = part.p_BoPo + R * own.p_BoBcm;
    mass += own.mass_kg;
    first += own.mass_kg * d;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        J_o(i, j) += (R * own.inertia_kgm2() * R.transpose())(i, j) +
                     own.mass_kg * ((i == j ? d.squaredNorm() : 0) - d(i) * d(j));
      }
    }
  }
  const Vector c = first / mass;
  const Matrix J_c = J_o - mass * (c.squaredNorm() * Matrix::Identity() - c * c.transpose());
  check_same(m, {mass, c, J_c / mass}, 1e-13);

  // Knows nothing of tensors: which parts hold a point, on a grid.
  const auto density = [&parts](const Vector& p) {
    double sum = 0;
    for (const CompoundPart& part : parts) {
      const Vector q = part.q_BP.conjugate() * (p - part.p_BoPo);
      const Vector a = q.cwiseAbs();
      bool holds = false;
      if (part.shape.kind == ShapeKind::box) {
        holds = (a.array() <= to_eigen(part.shape.half_extents_m()).array()).all();
      } else if (part.shape.kind == ShapeKind::sphere) {
        holds = a.norm() <= part.shape.radius_m();
      } else if (part.shape.kind == ShapeKind::cylinder) {
        holds = a.z() <= part.shape.half_length_m() &&
                std::hypot(a.x(), a.y()) <= part.shape.radius_m();
      } else {
        holds = a.sum() <= 0.7;
      }
      if (holds) sum += part.density_kgpm3;
    }
    return sum;
  };
  const MassDistribution s = sampled({-2, -2, -2}, {2, 2, 2}, 200, density);
  check_same(m, s, 2e-3);
}

TEST_CASE("a hull of many points agrees with sampling, and holds all of them") {
  std::mt19937_64 random(7);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  std::vector<Vector> points;
  for (int i = 0; i < 60; ++i) {
    points.emplace_back(uniform(), 0.6 * uniform() + 0.3, 1.4 * uniform() - 0.5);
  }
  const MadeGeometry made = make_hull(points);
  REQUIRE(made.geometry);
  const auto& hull = std::get<ConvexHull>(made.geometry->value);
  struct BoundingPlane {
    Vector n;
    double d;
  };
  std::vector<BoundingPlane> planes;
  std::size_t corners = 0;
  for (std::size_t f = 0; f < hull.face_count(); ++f) {
    const auto loop = hull.face(f);
    corners += loop.size();
    const Vector& o = hull.vertices[static_cast<std::size_t>(loop[0])];
    const Vector n = (hull.vertices[static_cast<std::size_t>(loop[1])] - o)
                         .cross(hull.vertices[static_cast<std::size_t>(loop[2])] - o)
                         .normalized();
    planes.push_back({n, n.dot(o)});
    for (const Vector& p : points) CHECK(n.dot(p) - planes.back().d < 1e-12);
  }
  // Euler's formula: V - E + F = 2.
  CHECK(hull.vertices.size() + hull.face_count() == corners / 2 + 2);
  const auto density = [&planes](const Vector& p) {
    return std::all_of(planes.begin(), planes.end(),
                       [&p](const BoundingPlane& plane) { return plane.n.dot(p) <= plane.d; })
               ? 1.0
               : 0.0;
  };
  check_same(mass_of(made), sampled({-1, -0.3, -1.9}, {1, 0.9, 0.9}, 120, density), 3e-3);
}

TEST_CASE("a solid twice as large has 8 times the mass and 32 times the moments") {
  const MassDistribution one = mass_of(mesh_of(torus_surface(2, 0.5, 24, 12)));
  const MassDistribution two = mass_of(mesh_of(torus_surface(4, 1, 24, 12)));
  CHECK(two.mass_kg == Approx(8 * one.mass_kg).epsilon(1e-13));
  CHECK(relative(two.inertia_kgm2(), 32 * one.inertia_kgm2()) < 1e-13);
  for (const Shape& shape : {Shape::capsule(0.3, 0.5), Shape::cone(0.3, 0.5),
                             Shape::ellipsoid({0.3, 0.5, 0.7}), Shape::cylinder(0.3, 0.5)}) {
    Shape twice = shape;
    for (double& p : twice.parameters) p *= 2;
    const MassDistribution a = mass_distribution(shape, 1), b = mass_distribution(twice, 1);
    CHECK(b.mass_kg == Approx(8 * a.mass_kg).epsilon(1e-14));
    CHECK(relative(b.inertia_kgm2(), 32 * a.inertia_kgm2()) < 1e-14);
  }
}

TEST_CASE("principal axes reproduce the tensor, right-handed and next to the axes of B") {
  std::mt19937_64 random(11);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  for (int i = 0; i < 2000; ++i) {
    const Rotation q = Rotation{uniform(), uniform(), uniform(), uniform()}.normalized();
    // Squares of extents: always moments of a body; every third is symmetric, every ninth round.
    Vector s{1 + uniform(), 1 + uniform(), 1 + uniform()};
    if (i % 3 == 0) s.y() = s.x();
    if (i % 9 == 0) s.z() = s.x();
    const Vector moments(s.y() + s.z(), s.z() + s.x(), s.x() + s.y());
    const Matrix R = q.toRotationMatrix();
    Matrix J = R * moments.asDiagonal() * R.transpose();
    J = 0.5 * (J + J.transpose().eval());
    const PrincipalAxes axes = principal_axes(J);
    const Matrix P = axes.q_BP.toRotationMatrix();
    CAPTURE(i);
    CHECK(relative(P * axes.moments.asDiagonal() * P.transpose(), J) < 1e-12);
    CHECK(std::abs(axes.q_BP.norm() - 1) < 1e-15);
    Vector sorted = axes.moments, expected = moments;
    std::sort(sorted.begin(), sorted.end());
    std::sort(expected.begin(), expected.end());
    CHECK((sorted - expected).norm() < 1e-12);
    // Of the 24 right-handed orders and signs none turns less, so that it is 62.8 degrees at most.
    CHECK(P.trace() > 2 * std::cos(62.9 / 180 * kPi));
    if (i % 9 == 0) CHECK(axes.are_of_B);
  }
}

TEST_CASE("bodies that are symmetric along their axes keep them") {
  for (const Surface& s :
       {box_surface({1, 1, 1}), box_surface({3, 1, 2}), octahedron_surface(1),
        torus_surface(2, 0.5, 32, 16), moved(box_surface({1, 1, 4}), {10, 20, 30})}) {
    const PrincipalAxes axes = principal_axes(mass_of(mesh_of(s)).inertia_kgm2());
    CHECK(axes.are_of_B);
  }
  // A rod that points along (1, 2, 3): its third axis does, by the shortest turn from z.
  const Vector along = Vector(1, 2, 3).normalized();
  const Matrix J = 5 * Matrix::Identity() - 4 * along * along.transpose();
  const PrincipalAxes axes = principal_axes(J);
  CHECK((axes.q_BP * Vector::UnitZ() - along).norm() < 1e-14);
  CHECK(axes.q_BP.angularDistance(turn_onto(Vector::UnitZ(), along)) < 1e-7);
}

}  // namespace cradle
