// Errors on terrains: who went through.
#include <algorithm>
#include <cmath>

#include "tests/bench/measure.h"

namespace cradle::bench {
namespace {

/// Height of a mesh over points of the plane z = 0, by a grid of its own.
class Ground {
 public:
  explicit Ground(const TriangleMesh& mesh) : mesh_(mesh), cells_(kCells * kCells) {
    for (const Vector& v : mesh.vertices) {
      lower_ = lower_.cwiseMin(v);
      upper_ = upper_.cwiseMax(v);
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      Vector low = upper_, high = lower_;
      for (std::size_t k = 0; k < 3; ++k) {
        low = low.cwiseMin(corner(t, k));
        high = high.cwiseMax(corner(t, k));
      }
      for (std::size_t i = cell(low.x(), 0); i <= cell(high.x(), 0); ++i) {
        for (std::size_t j = cell(low.y(), 1); j <= cell(high.y(), 1); ++j)
          cells_[i * kCells + j].push_back(t);
      }
    }
  }

  /// NaN beside the mesh.
  double height(double x, double y) const {
    for (const std::size_t t : cells_[cell(x, 0) * kCells + cell(y, 1)]) {
      const Vector a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
      const auto turn = [&](const Vector& p, const Vector& q) {
        return (q.x() - p.x()) * (y - p.y()) - (q.y() - p.y()) * (x - p.x());
      };
      const double u = turn(b, c), v = turn(c, a), w = turn(a, b);
      if (u < 0 || v < 0 || w < 0 || !(u + v + w > 0)) continue;
      return (u * a.z() + v * b.z() + w * c.z()) / (u + v + w);
    }
    return std::nan("");
  }

 private:
  static constexpr std::size_t kCells = 64;

  const Vector& corner(std::size_t t, std::size_t k) const {
    return mesh_.vertices[static_cast<std::size_t>(mesh_.triangles[t][k])];
  }
  std::size_t cell(double at, int axis) const {
    const double share = (at - lower_[axis]) / (upper_[axis] - lower_[axis]);
    if (!(share > 0)) return 0;  // also what is not a number
    return static_cast<std::size_t>(std::min(share * kCells, kCells - 1.0));
  }

  const TriangleMesh& mesh_;
  Vector lower_ = Vector::Constant(1e300), upper_ = Vector::Constant(-1e300);
  std::vector<std::vector<std::size_t>> cells_;
};

/// Bodies that began over the ground and have their origin below it, or are beside it, after the
/// last tick.
class BelowTerrain final : public Measure {
 public:
  explicit BelowTerrain(const Scene& scene)
      : geometry_(scene.geometries.at(0)), ground_(std::get<TriangleMesh>(geometry_->value)) {
    for (const std::size_t i : dynamic_bodies(scene)) {
      if (is_above(scene.bodies[i].p_WBo)) bodies_.push_back(i);
    }
  }

  void tick(const Observation& now) override {
    below_ = 0;
    for (const std::size_t i : bodies_) {
      const Vec3& p = now.states[i].p_WBo;
      if (!is_above(p)) below_ += std::isfinite(p.x + p.y + p.z) ? 1 : std::nan("");
    }
  }
  double error() const override { return below_; }

 private:
  bool is_above(const Vec3& p) const { return p.z > ground_.height(p.x, p.y); }

  GeometryPointer geometry_;
  Ground ground_;
  std::vector<std::size_t> bodies_;
  double below_ = 0;
};

}  // namespace

std::unique_ptr<Measure> bodies_below_terrain(const Scene& scene) {
  return std::make_unique<BelowTerrain>(scene);
}

}  // namespace cradle::bench
