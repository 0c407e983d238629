// The contacts of a convex shape with the triangles of a surface, put together to manifolds.
//
// Contacts whose normals are nearly the same make one manifold; of those at one place one is left,
// and of more than four the four that carry most. A manifold is named by the direction of its
// normal in the surface's frame, to 40 degrees or so; and where a body touches twice in such a
// range, by a number.
#include "server/collision/surface_manifolds.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/collision/bounds.h"
#include "server/collision/four_points.h"
#include "server/collision/surface_contacts.h"

namespace cradle {
namespace {

/// Twelve directions all around: the corners of an icosahedron, turned at random so that the
/// directions of built things are not midway between two.
constexpr double kDirections[12][3] = {
    {0.061, 0.880, -0.471},  {0.889, 0.237, -0.391},   {0.073, -0.030, -0.997},
    {0.807, -0.288, 0.516},  {-0.514, -0.721, -0.464}, {-0.534, 0.752, 0.387},
    {-0.807, 0.288, -0.516}, {0.514, 0.721, 0.464},    {0.534, -0.752, -0.387},
    {-0.061, -0.880, 0.471}, {-0.889, -0.237, 0.391},  {-0.073, 0.030, 0.997},
};

std::uint64_t code_of(const Vector& n) {
  std::uint64_t best = 0;
  double most = -2;
  for (std::uint64_t i = 0; i < 12; ++i) {
    const auto& d = kDirections[i];
    const double along = d[0] * n.x() + d[1] * n.y() + d[2] * n.z();
    if (along > most) most = along, best = i;
  }
  return best;
}

/// A contact with its place across the normal, for the choice of four.
struct Candidate {
  Vector p;
  const SurfaceContact* contact;
};

/// Room that is used again.
struct Room {
  SurfaceFindings findings;
  std::vector<std::int32_t> near;    ///< triangles
  std::vector<std::uint32_t> order;  ///< of contacts, the deepest first
  std::vector<std::uint32_t> members;
  std::vector<Candidate> candidates;
  std::vector<std::uint64_t> parts;  ///< of manifolds
};

/// Whether `c` is on the line between two others of one manifold, and no deeper than it is there.
bool is_between(const Candidate& c, const Candidate& from, const Candidate& to, double slack) {
  const Vector way = to.p - from.p, d = c.p - from.p;
  const double length2 = way.head<2>().squaredNorm();
  const double on = way.head<2>().dot(d.head<2>()) / length2;
  if (!(on > 0 && on < 1)) return false;
  const Vector off = d - on * way;
  return off.head<2>().squaredNorm() < slack * slack && off.z() > -kTolerances.witness_m;
}

/// Takes out points of no feature, each the nearest one of a triangle that has no other, between
/// two that have one: of how a flat surface is cut into triangles nothing is seen by a rod on it.
/// `candidates` are sorted by name.
void take_out_between(std::vector<Candidate>& candidates, double slack) {
  const auto named =
      std::ranges::find_if(candidates, [](const Candidate& c) { return c.contact->name != 0; });
  const std::span<const Candidate> others(named, candidates.end());
  const auto is_held = [&](const Candidate& c) {
    return std::ranges::any_of(others, [&](const Candidate& from) {
      return std::ranges::any_of(
          others, [&](const Candidate& to) { return is_between(c, from, to, slack); });
    });
  };
  candidates.erase(std::remove_if(candidates.begin(), named, is_held), named);
}

/// The contacts in `members` as one manifold of normal `n`, in S.
void write_manifold(const Vector& n, const Pose& X_WS, double same_place, Room& room,
                    Manifold& manifold) {
  const Vector helper = std::abs(n.x()) < 0.57 ? Vector::UnitX() : Vector::UnitY();
  const Vector x = helper.cross(n).normalized(), y = n.cross(x);
  room.candidates.clear();
  for (const std::uint32_t i : room.members) {
    const SurfaceContact& c = room.findings.contacts[i];
    room.candidates.push_back({{x.dot(c.p), y.dot(c.p), c.separation}, &c});
  }
  // By name, so that rounding does not choose.
  std::sort(
      room.candidates.begin(), room.candidates.end(),
      [](const Candidate& a, const Candidate& b) { return a.contact->name < b.contact->name; });
  take_out_between(room.candidates, same_place);
  std::span<Candidate> chosen(room.candidates);
  if (chosen.size() > kManifoldPoints) {
    bring_best_four(chosen);
    chosen = chosen.first(kManifoldPoints);
  }
  manifold.normal_W = X_WS.R * n;
  manifold.count = static_cast<int>(chosen.size());
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const SurfaceContact& c = *chosen[k].contact;
    std::uint32_t name = c.name;
    for (std::size_t i = 0; i < k; ++i) {
      if (manifold.points[i].feature == name) name += 2, i = static_cast<std::size_t>(-1);
    }
    manifold.points[k] = {X_WS.x + X_WS.R * c.p, chosen[k].p.z(), name};
  }
}

/// Gives manifolds of one direction numbers by the names of their points: the deepest may be
/// another one in the next tick. `part` of each is its direction until then.
void number(std::uint64_t part, Room& room, std::span<Manifold> manifolds) {
  const auto name = [](const Manifold& m) {
    const auto begin = m.points.begin(), end = begin + m.count;
    return std::pair(std::ranges::min_element(begin, end, {}, &ContactPoint::feature)->feature, &m);
  };
  std::vector<std::uint64_t>& parts = room.parts;
  parts.clear();
  for (const Manifold& m : manifolds) {
    const auto before = std::ranges::count_if(manifolds, [&](const Manifold& other) {
      return other.part == m.part && name(other) < name(m);
    });
    parts.push_back(part | m.part << 28 | static_cast<std::uint64_t>(before));
  }
  for (std::size_t k = 0; k < parts.size(); ++k) manifolds[k].part = parts[k];
}

/// Groups the contacts, the deepest first, which gives its group the normal.
void group(const Pose& X_WS, double same_place, std::uint64_t part, Room& room,
           std::vector<Manifold>& manifolds) {
  std::vector<SurfaceContact>& all = room.findings.contacts;
  room.order.resize(all.size());
  for (std::uint32_t i = 0; i < room.order.size(); ++i) room.order[i] = i;
  // The first found of those as deep: std::stable_sort would ask for memory.
  std::sort(room.order.begin(), room.order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(all[a].separation, a) < std::pair(all[b].separation, b);
  });
  const std::size_t first = manifolds.size();
  while (!room.order.empty()) {
    const Vector n = all[room.order.front()].normal;
    room.members.clear();
    const auto rest = std::remove_if(room.order.begin(), room.order.end(), [&](std::uint32_t i) {
      if (all[i].normal.dot(n) < kTolerances.one_manifold_cosine) return false;
      const auto there = std::ranges::find_if(room.members, [&](std::uint32_t j) {
        return (all[i].p - all[j].p).squaredNorm() < same_place * same_place;
      });
      if (there == room.members.end()) {
        room.members.push_back(i);
      } else if (all[i].separation < all[*there].separation + kTolerances.witness_m) {
        // As deep but for rounding, which does not choose the name.
        all[*there].name = std::min(all[*there].name, all[i].name);
      }
      return true;
    });
    room.order.erase(rest, room.order.end());
    Manifold& manifold = manifolds.emplace_back();
    manifold.part = code_of(n);
    write_manifold(n, X_WS, same_place, room, manifold);
  }
  number(part, room, std::span(manifolds).subspan(first));
}

struct NearestTriangle {
  std::int32_t number = -1;
  double distance = std::numeric_limits<double>::infinity();
  double height = 0;  ///< over its plane
};

/// Of those whose boxes come within `reach` of p.
NearestTriangle nearest_within(const SurfaceView& surface, const Vector& p, double reach) {
  NearestTriangle nearest;
  const Vector half = Vector::Constant(reach);
  surface.for_each_in({p - half, p + half}, [&](std::int32_t number) {
    const SurfaceTriangle t = surface.triangle(number);
    const Vector d = p - nearest_point(t, p);
    const double distance = d.norm(), height = t.normal.dot(d);
    // At an edge all its triangles are as near: the one that p is most before or behind tells
    // the side.
    const double tie = kTolerances.seam * (1 + distance);
    const bool is_as_near =
        distance < nearest.distance + tie && std::abs(height) > std::abs(nearest.height);
    if (distance > nearest.distance - tie && !is_as_near) return;
    nearest = {number, std::min(nearest.distance, distance), height};
  });
  return nearest;
}

/// The triangle that is nearest to `p`, a point inside a closed mesh; negative if p is outside.
std::int32_t nearest_around(const SurfaceView& surface, const Vector& p, double first_reach) {
  const Aabb whole = surface.box();
  if (!(p.array() >= whole.lower.array()).all() || !(p.array() <= whole.upper.array()).all()) {
    return -1;
  }
  const double size = (whole.upper - whole.lower).maxCoeff();
  for (double reach = first_reach;; reach *= 2) {
    const NearestTriangle nearest = nearest_within(surface, p, reach);
    if (nearest.number >= 0 && (nearest.distance <= reach || reach > size)) {
      return nearest.height < 0 ? nearest.number : -1;
    }
    if (reach > size) return -1;
  }
}

/// The triangle of an open mesh that `p` is behind by no more than `depth`; negative: none.
std::int32_t just_behind(const SurfaceView& surface, const Vector& p, double depth) {
  const NearestTriangle nearest = nearest_within(surface, p, depth);
  if (!(nearest.height < 0 && nearest.distance <= depth)) return -1;
  const SurfaceTriangle t = surface.triangle(nearest.number);
  for (std::size_t k = 0; k < 3; ++k) {
    const bool is_beside = t.normal.cross(t.edge(k)).dot(p - t.corners[k]) < 0;
    if (is_beside && surface.edge_kind(t, k) == EdgeKind::border) return -1;
  }
  return nearest.number;
}

/// C's middle may be in the solid behind the surface: out by the shortest way, then, and nothing
/// else counts. What is behind an open mesh with its middle by no more than half of its thickness
/// has been pressed through, so it is pushed back.
void push_out(const SurfaceView& surface, SurfaceContactFinder& finder, double reach,
              std::vector<SurfaceContact>& contacts) {
  const Vector& c = finder.centre();
  std::int32_t number = -1;
  if (surface.field() != nullptr) {
    number = surface.triangle_at(c.x(), c.y());
    if (number >= 0) {
      const SurfaceTriangle t = surface.triangle(number);
      if (t.normal.dot(c - t.corners[0]) >= 0) number = -1;
    }
  } else if (surface.mesh()->is_closed) {
    number = nearest_around(surface, c, reach);
    if (number < 0 && contacts.empty()) return finder.add_way_out();
  } else if (finder.came_from_behind()) {
    number = just_behind(surface, c, 0.5 * finder.thickness());
  }
  if (number < 0) return;
  contacts.clear();
  finder.add_plane(surface.triangle(number));
}

Room& room_of_thread() {
  thread_local Room room;
  room.findings.clear();
  room.near.clear();
  return room;
}

/// m, by which two boxes are apart along some axis; negative: they overlap.
double gap(const Aabb& a, const Aabb& b) {
  return (a.lower - b.upper).cwiseMax(b.lower - a.upper).maxCoeff();
}

Aabb box_of(const SurfaceTriangle& t) {
  const auto& p = t.corners;
  return {p[0].cwiseMin(p[1]).cwiseMin(p[2]), p[0].cwiseMax(p[1]).cwiseMax(p[2])};
}

bool is_finite(const Pose& X) {
  return X.x.squaredNorm() < kInfinity && X.R.squaredNorm() < kInfinity;
}

}  // namespace

void add_surface_manifolds(const Collider& collider, const Collider& convex, double margin,
                           std::uint64_t part, std::vector<Manifold>& manifolds) {
  const SurfaceView surface(collider);
  const Pose& X_WS = collider.X_WB;
  const Pose X_SC{X_WS.R.transpose() * (convex.X_WB.x - X_WS.x),
                  X_WS.R.transpose() * convex.X_WB.R};
  if (!surface.is_there() || !is_finite(X_SC)) return;
  Room& room = room_of_thread();
  SurfaceContactFinder finder(surface, convex, X_SC, margin, room.findings);
  const Aabb box = bounds(Collider{convex.shape, X_SC, convex.geometry});
  surface.for_each_in(swept(box, Vector::Zero(), margin), [&](std::int32_t t) {
    room.near.push_back(t);
    surface.expect(t);
  });
  for (const std::int32_t t : room.near) finder.add(surface.triangle(t));
  finder.settle();
  if (finder.came_from_behind() || room.findings.contacts.empty()) {
    push_out(surface, finder, (box.upper - box.lower).maxCoeff(), room.findings.contacts);
  }
  group(X_WS, finder.same_place(), part, room, manifolds);
}

double surface_gap(const Collider& collider, const Collider& convex, double margin) {
  const SurfaceView surface(collider);
  const Pose& X_WS = collider.X_WB;
  const Pose X_SC{X_WS.R.transpose() * (convex.X_WB.x - X_WS.x),
                  X_WS.R.transpose() * convex.X_WB.R};
  if (!surface.is_there() || !is_finite(X_SC)) return 0;
  const Aabb box = bounds(Collider{convex.shape, X_SC, convex.geometry});
  // Of C's size: to look farther takes longer, through more triangles, than it saves.
  constexpr double kAhead = 0.5;
  double least = margin + kAhead * (box.upper - box.lower).maxCoeff();
  surface.for_each_in(swept(box, Vector::Zero(), least), [&](std::int32_t t) {
    least = std::min(least, gap(box, box_of(surface.triangle(t))));
  });
  // Beside a field, the way into the ground is open to C's middle.
  if (surface.field() != nullptr) {
    const Aabb whole = surface.box();
    const Vector c = X_SC.x + X_SC.R * ConvexShape(convex).centre;
    const Vector beside = (whole.lower - c).cwiseMax(c - whole.upper);
    const double outside = beside.head<2>().maxCoeff();
    if (outside > 0) least = std::min(least, outside);
  }
  return least - kTolerances.seam * (1 + X_SC.x.cwiseAbs().maxCoeff());
}

void add_surface_half_space(const Collider& collider, const Collider& half_space, double margin,
                            std::uint64_t part, std::vector<Manifold>& manifolds) {
  const SurfaceView surface(collider);
  const Pose& X_WS = collider.X_WB;
  const Vector up_W = half_space.X_WB.R.col(2);
  const Vector up = X_WS.R.transpose() * up_W;
  const double offset = up_W.dot(X_WS.x - half_space.X_WB.x);
  if (surface.mesh() == nullptr || !is_finite(X_WS) || !std::isfinite(offset)) return;
  Room& room = room_of_thread();
  const std::vector<Vector>& vertices = surface.mesh()->vertices;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const double s = up.dot(vertices[v]) + offset;
    if (s > margin) continue;
    room.findings.contacts.push_back(
        {-up, vertices[v] - up * (0.5 * s), s, name_of_vertex(static_cast<std::int32_t>(v))});
  }
  group(X_WS, 0, part, room, manifolds);
}

}  // namespace cradle
