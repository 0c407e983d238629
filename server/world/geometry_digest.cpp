#include "server/world/geometry_digest.h"

#include <xxhash.h>

namespace cradle {
namespace {

/// Takes in one thing after another; lists with their lengths, so that none can pass for two.
class Digest {
 public:
  template <class T>
  void add(std::span<const T> items) {
    const std::uint64_t count = items.size();
    add_bytes(&count, sizeof count);
    add_bytes(items.data(), items.size_bytes());
  }
  void add(std::uint64_t number) { add_bytes(&number, sizeof number); }
  std::uint64_t value() const { return value_; }

 private:
  void add_bytes(const void* bytes, std::size_t size) {
    value_ = XXH3_64bits_withSeed(bytes, size, value_);
  }
  std::uint64_t value_ = 0;
};

struct Visitor {
  Digest& all;

  void operator()(const ConvexHull& hull) const {
    all.add(std::span(hull.vertices));
    all.add(std::span(hull.loops));
    all.add(std::span(hull.first));
  }
  void operator()(const TriangleMesh& mesh) const {
    all.add(std::span(mesh.vertices));
    all.add(std::span(mesh.triangles));
  }
  void operator()(const ConvexPolygon& polygon) const { all.add(std::span(polygon.corners)); }
  void operator()(const HeightField& field) const {
    all.add(static_cast<std::uint64_t>(field.rows));
    all.add(static_cast<std::uint64_t>(field.columns));
    all.add(std::span<const double>(&field.spacing_x_m, 1));
    all.add(std::span<const double>(&field.spacing_y_m, 1));
    all.add(std::span(field.heights));
  }
  void operator()(const Compound& compound) const {
    all.add(compound.parts.size());
    for (const CompoundPart& part : compound.parts) {
      all.add(static_cast<std::uint64_t>(part.shape.kind));
      // The number of a stored shape says nothing; what it stands for does.
      if (part.geometry) all.add(digest(*part.geometry));
      if (!part.geometry) all.add(std::span<const double>(part.shape.parameters));
      all.add(std::span<const double>(part.p_BoPo.data(), 3));
      all.add(std::span<const double>(part.q_BP.coeffs().data(), 4));
      all.add(std::span<const double>(&part.density_kgpm3, 1));
    }
  }
};

}  // namespace

std::uint64_t digest(const StoredGeometry& geometry) {
  Digest all;
  all.add(geometry.value.index());
  std::visit(Visitor{all}, geometry.value);
  return all.value();
}

}  // namespace cradle
