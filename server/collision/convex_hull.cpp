// The convex hull by Qhull (Barber, Dobkin, Huhdanpaa, ACM Trans. Math. Softw. 22, 1996), which
// merges facets that are coplanar up to rounding. What it returns is checked: every edge must have
// two faces that run along it in opposite directions, and the inside must be on the right side; and
// it is asked for once more where a point that it left out is far outside.
#include <cradle/limits.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <numeric>
#include <set>
#include <string_view>

#include "server/collision/index.h"
#include "server/collision/stored_geometry.h"
#include "server/collision/tolerances.h"

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace cradle {
namespace {

using Loop = std::vector<std::int32_t>;

/// The largest of `f(p)` over the points, and where.
template <class F>
std::pair<double, Vector> largest(std::span<const Vector> points, F&& f) {
  std::pair<double, Vector> best{-1, Vector::Zero()};
  for (const Vector& p : points) {
    const double value = f(p);
    if (value > best.first) best = {value, p};
  }
  return best;
}

/// Points at one place, on a line or in a plane have no solid hull; so thin a solid as the smallest
/// box must be counts as none, and a needle whose moments rounding would swallow.
std::string flatness(std::span<const Vector> points) {
  static_assert(limits::kSizeMin_m == 1e-4, "the text below says so");
  constexpr const char* kWanted =
      "; a hull must be wider than 1e-4 m in every direction, and than 1e-7 of its length";
  constexpr double kThinnest = 1e-7;
  const auto flat = [&](const char* how) { return std::string(how).append(kWanted); };
  const Vector a = points[0];
  const auto [length, b] = largest(points, [&](const Vector& p) { return (p - a).norm(); });
  if (!(length > limits::kSizeMin_m)) return flat("the points are all at one place");
  const double least = std::max(limits::kSizeMin_m, kThinnest * length);
  const Vector along = (b - a).normalized();
  const auto [width, c] =
      largest(points, [&](const Vector& p) { return along.cross(p - a).norm(); });
  if (!(width > least)) return flat("the points are all on one line");
  const Vector normal = along.cross(c - a).normalized();
  const double thickness =
      largest(points, [&](const Vector& p) { return std::abs(normal.dot(p - a)); }).first;
  if (!(thickness > least)) return flat("the points are all in one plane");
  return {};
}

/// One run of Qhull.
class Qhull {
 public:
  Qhull() {
    errors_ = open_memstream(&text_, &text_size_);
    qh_zero(&qhull_, errors_);
  }
  ~Qhull() {
    int blocks = 0, bytes = 0;
    qh_freeqhull(&qhull_, !qh_ALL);
    qh_memfreeshort(&qhull_, &blocks, &bytes);
    std::fclose(errors_);
    std::free(text_);
  }
  Qhull(const Qhull&) = delete;
  Qhull& operator=(const Qhull&) = delete;

  /// The faces as loops of point numbers, counter-clockwise; empty if there is no hull. Points that
  /// are outside of all others by `least` and less are no corners.
  std::vector<Loop> faces_of(std::vector<double>& coordinates, double least) {
    std::array<char, 64> command{"qhull Pp W"};  // Pp: no remarks about precision
    std::to_chars(command.data() + std::string_view(command.data()).size(), command.end() - 1,
                  least);
    const int failed = qh_new_qhull(&qhull_, 3, static_cast<int>(coordinates.size() / 3),
                                    coordinates.data(), False, command.data(), nullptr, errors_);
    std::vector<Loop> faces;
    if (failed != 0) return faces;
    qhT* const qh = &qhull_;  // the name that Qhull's macros want
    const facetT* facet = nullptr;
    FORALLfacets { faces.push_back(loop_of(const_cast<facetT*>(facet))); }
    outside_ = qh->max_outside;
    return faces;
  }

  /// How far the farthest point is outside of a face of these.
  double outside() const { return outside_; }

  std::string errors() {
    std::fflush(errors_);
    const std::string_view all(text_, text_size_);
    return std::string(all.substr(0, all.find('\n')));
  }

 private:
  Loop loop_of(facetT* facet) {
    Loop loop;
    setT* const corners = qh_facet3vertex(&qhull_, facet);
    for (int k = 0; k < qh_setsize(&qhull_, corners); ++k) {
      const auto* vertex = static_cast<vertexT*>(corners->e[k].p);
      loop.push_back(qh_pointid(&qhull_, vertex->point));
    }
    setT* freed = corners;
    qh_settempfree(&qhull_, &freed);
    std::reverse(loop.begin(), loop.end());  // it gives them clockwise as seen from outside
    std::rotate(loop.begin(), std::min_element(loop.begin(), loop.end()), loop.end());
    return loop;
  }

  qhT qhull_;
  FILE* errors_ = nullptr;
  char* text_ = nullptr;
  std::size_t text_size_ = 0;
  double outside_ = 0;
};

/// Whether the loops are a closed surface around the origin.
bool is_closed(const std::vector<Loop>& faces, std::span<const Vector> points) {
  std::set<std::pair<std::int32_t, std::int32_t>> edges;
  for (const Loop& loop : faces) {
    if (loop.size() < 3) return false;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      if (!edges.emplace(loop[k], loop[(k + 1) % loop.size()]).second) return false;
    }
  }
  if (!std::all_of(edges.begin(), edges.end(), [&](const auto& e) {
        return edges.contains({e.second, e.first});
      })) {
    return false;
  }
  double volume = 0;
  for (const Loop& loop : faces) {
    for (std::size_t k = 1; k + 1 < loop.size(); ++k) {
      volume +=
          points[index(loop[0])].dot(points[index(loop[k])].cross(points[index(loop[k + 1])]));
    }
  }
  return volume > 0;
}

/// The hull with the vertices that the faces have, in the order of the points.
ConvexHull compact(std::vector<Loop> faces, std::span<const Vector> points) {
  std::sort(faces.begin(), faces.end());
  std::vector<std::int32_t> number(points.size(), -1);
  for (const Loop& loop : faces) {
    for (const std::int32_t v : loop) number[index(v)] = 0;
  }
  ConvexHull hull;
  for (std::size_t v = 0; v < points.size(); ++v) {
    if (number[v] < 0) continue;
    number[v] = static_cast<std::int32_t>(hull.vertices.size());
    hull.vertices.push_back(points[v]);
  }
  for (const Loop& loop : faces) {
    for (const std::int32_t v : loop) hull.loops.push_back(number[index(v)]);
    hull.first.push_back(static_cast<std::int32_t>(hull.loops.size()));
  }
  complete(hull);
  return hull;
}

}  // namespace

MadeGeometry make_hull(std::span<const Vector> points) {
  if (points.size() < 4) return {nullptr, "a hull needs four points or more"};
  if (points.size() > static_cast<std::size_t>(limits::kPoints)) {
    return {nullptr, "there are too many points"};
  }
  Vector lower = points[0], upper = points[0];
  for (const Vector& p : points) {
    if (!p.allFinite()) return {nullptr, "the points must be finite"};
    if (p.cwiseAbs().maxCoeff() > limits::kSizeMax_m) return {nullptr, "a point is out of range"};
    lower = lower.cwiseMin(p);
    upper = upper.cwiseMax(p);
  }
  std::string fault = flatness(points);
  if (!fault.empty()) return {nullptr, fault};

  // About their middle, since Qhull's idea of rounding grows with the coordinates.
  const Vector middle = 0.5 * (lower + upper);
  std::vector<Vector> centred;
  std::vector<double> coordinates;
  for (const Vector& p : points) {
    centred.emplace_back(p - middle);
    coordinates.insert(coordinates.end(), centred.back().begin(), centred.back().end());
  }
  // A point is left out as near to a face that may go; then it is farther outside of the next one.
  const double least = kTolerances.corner_by_length * (upper - lower).maxCoeff();
  std::vector<Loop> faces;
  for (const double share : {1.0, 1e-3}) {
    Qhull qhull;
    faces = qhull.faces_of(coordinates, share * least);
    if (faces.empty()) return {nullptr, "the points have no hull: " + qhull.errors()};
    if (qhull.outside() <= 2 * least) break;
  }
  if (!is_closed(faces, centred)) return {nullptr, "the points have no hull: it is not closed"};
  return {std::make_shared<const StoredGeometry>(StoredGeometry{compact(std::move(faces), points)}),
          {}};
}

}  // namespace cradle
