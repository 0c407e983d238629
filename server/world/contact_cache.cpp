#include "server/world/contact_cache.h"

#include <algorithm>
#include <array>
#include <utility>

namespace cradle {

namespace {

/// Of the arm: points of one face are no farther from its plane.
constexpr double kInPlane = 0.05;
/// Of the force: what points may be asked to pull before they are said not to carry the same.
constexpr double kMayPull = 0.05;

/// Constraints that one thread stores at a time.
constexpr std::size_t kChunk = 256;

/// Entries of a constraint, at most.
constexpr std::size_t kEntries = kManifoldPoints + 1;

/// Whether its points remember nothing but that they are not new.
bool is_idle(const ContactConstraint& c) {
  return std::ranges::all_of(c.used(), [&c](const ConstraintPoint& p) {
    return p.force == 0 && p.press == 0 && (!c.has_rested || c.rest(p).is_none());
  });
}

/// Returns where the next entry goes.
CachedForce* write(const ContactConstraint& c, std::span<const std::int64_t> ids,
                   CachedForce* next) {
  const std::int64_t a = ids[static_cast<std::size_t>(c.a)], b = ids[static_cast<std::size_t>(c.b)];
  const Vector t2 = c.t2();
  if (is_idle(c)) {
    *next++ = {a, b, c.part, kIdleFeature, 0, 0, c.K_normals[0]};
  } else {
    for (std::size_t i = 0; i < c.used().size(); ++i) {
      const ConstraintPoint& p = c.points[i];
      const PointRest rest = c.has_rested ? c.rests[i] : PointRest{};
      *next++ = {a,
                 b,
                 c.part,
                 c.features[i],
                 p.force,
                 p.press,
                 c.K_normals[i],
                 rest.m,
                 rest.load,
                 p.force_t.x() * c.t1 + p.force_t.y() * t2,
                 p.rA};
    }
  }
  if (c.turns_heavily()) {
    *next++ = {a, b, c.part, kTurningFeature, 0, 0, 0, 0, 0, c.torque, Vector::Zero()};
  }
  return next;
}

/// Of its points, the one with this feature; their number if there is none.
std::size_t find(const ContactConstraint& c, std::uint64_t feature) {
  const auto begin = c.features.begin(), end = begin + c.count;
  return static_cast<std::size_t>(std::find(begin, end, feature) - begin);
}

}  // namespace

ContactCache::Reader::Reader(const ContactCache& cache, std::span<const std::int64_t> ids,
                             std::int32_t a, std::int32_t b)
    : ids_(ids), entry_(cache.runs_) {
  const auto name = [](const CachedForce& e) { return std::pair(e.a, e.b); };
  const auto pair = std::pair(ids[static_cast<std::size_t>(a)], ids[static_cast<std::size_t>(b)]);
  const auto run = std::ranges::lower_bound(cache.runs_, pair, {},
                                            [&](const Run& r) { return name(*(r.end - 1)); });
  entry_ = Cursor(std::span(run, cache.runs_.end()));
  if (entry_.is_end()) return;
  entry_.go_to(std::ranges::lower_bound(run->begin, run->end, pair, {}, name));
}

void ContactCache::Reader::restore(ContactConstraint& c) {
  const auto pair =
      std::pair(ids_[static_cast<std::size_t>(c.a)], ids_[static_cast<std::size_t>(c.b)]);
  while (!entry_.is_end() && std::pair(entry_->a, entry_->b) < pair) ++entry_;
  int gone = 0, found = 0;
  const Vector t2 = c.t2();
  for (Cursor e = entry_; !e.is_end() && std::pair(e->a, e->b) == pair; ++e) {
    if (e->part != c.part) continue;
    c.is_known = true;
    if (e->feature == kTurningFeature) {
      if (c.turns_heavily()) c.torque = e->friction;
      continue;
    }
    if (e->feature == kIdleFeature) {
      c.K_normals.fill(e->K_normal);
      continue;
    }
    const std::size_t i = find(c, e->feature);
    if (i == c.used().size()) {
      gone += e->force > 0 ? 1 : 0;
      continue;
    }
    ++found;
    ConstraintPoint& p = c.points[i];
    p.force = e->force;
    p.press = e->press;
    p.force_t = {c.t1.dot(e->friction), t2.dot(e->friction)};
    c.K_normals[i] = e->K_normal;
    if (e->rest_m != 0 || e->rest_load != 0) c.set_rest(p, {e->rest_m, e->rest_load});
  }
  if (gone > 0 && found < c.count) hand_on(c, entry_);
}

/// The least forces l_i >= 0 of the new points with  sum l_i (1, u_i, v_i) = sum of what is gone,
/// u and v in the plane of contact:  l_i = (1, u_i, v_i) . y,  sum (1, u, v)(1, u, v)^T y = that
/// sum.
void ContactCache::Reader::hand_on(ContactConstraint& c, Cursor of_pair) {
  const auto pair = std::pair(of_pair->a, of_pair->b);
  std::array<ConstraintPoint*, kManifoldPoints> fresh{};
  std::size_t count = 0;
  for (ConstraintPoint& p : c.used()) fresh[count++] = &p;
  Vector gone = Vector::Zero(), friction = Vector::Zero();
  const Vector origin = c.points[0].rA, t2 = c.t2();
  const auto in_plane = [&](const Vector& arm) {
    return Vector(1, c.t1.dot(arm - origin), t2.dot(arm - origin));
  };
  double press = 0;
  for (Cursor e = of_pair; !e.is_end() && std::pair(e->a, e->b) == pair; ++e) {
    if (e->part != c.part || e->feature == kTurningFeature) continue;
    const std::size_t i = find(c, e->feature);
    if (i < c.used().size()) {
      const auto last = std::remove(fresh.begin(), fresh.begin() + count, &c.points[i]);
      count = static_cast<std::size_t>(last - fresh.begin());
      continue;
    }
    if (std::abs(c.n.dot(e->arm - origin)) > kInPlane * origin.norm()) return;
    gone += e->force * in_plane(e->arm);
    friction += e->friction;
    press = std::max(press, e->press);
  }
  const std::span<ConstraintPoint*> points(fresh.data(), count);
  Matrix G = Matrix::Zero();
  for (const ConstraintPoint* p : points) G += in_plane(p->rA) * in_plane(p->rA).transpose();
  G += 1e-9 * G.trace() * Matrix::Identity();
  const Vector y = G.ldlt().solve(gone);
  double sum = 0;
  for (const ConstraintPoint* p : points) {
    const double force = y.dot(in_plane(p->rA));
    if (force < -kMayPull * gone[0]) return;
    sum += std::max(force, 0.0);
  }
  if (!(sum > 0)) return;
  for (ConstraintPoint* p : points) {
    const double share = std::max(y.dot(in_plane(p->rA)), 0.0) / sum;
    p->force = share * gone[0];
    p->force_t = share * Eigen::Vector2d(c.t1.dot(friction), t2.dot(friction));
    p->press = p->force > 0 ? press : 0;
  }
}

void ContactCache::store(Executor& executor, std::span<const std::int64_t> ids,
                         std::span<const ContactConstraint> constraints) {
  const std::size_t needed = kEntries * constraints.size();
  if (room_.size() < needed) room_.resize(needed + needed / 4);
  runs_.resize(chunks_of(constraints.size(), kChunk));
  for_chunks(executor, constraints.size(), kChunk,
             [&](std::size_t chunk, std::size_t begin, std::size_t end) {
               Run& run = runs_[chunk];
               run.begin = run.end = room_.data() + kEntries * begin;
               for (std::size_t k = begin; k < end; ++k) {
                 run.end = write(constraints[k], ids, run.end);
               }
             });
  std::erase_if(runs_, [](const Run& run) { return run.begin == run.end; });
}

void ContactCache::keep_first(std::size_t count) {
  runs_.clear();
  if (count > 0) runs_.push_back({room_.data(), room_.data() + count});
}

std::span<CachedForce> ContactCache::entries() {
  CachedForce* end = room_.data();
  for (const Run& run : runs_) {
    end = run.begin == end ? run.end : std::copy(run.begin, run.end, end);
  }
  keep_first(static_cast<std::size_t>(end - room_.data()));
  return {room_.data(), end};
}

void ContactCache::set(std::span<const CachedForce> entries) {
  if (room_.size() < entries.size()) room_.resize(entries.size());
  std::ranges::copy(entries, room_.begin());
  keep_first(entries.size());
}

void ContactCache::forget(std::span<const std::int64_t> ids) {
  const auto is_among = [&](std::int64_t id) {
    return std::binary_search(ids.begin(), ids.end(), id);
  };
  forget_if([&](const CachedForce& e) { return is_among(e.a) || is_among(e.b); });
}

}  // namespace cradle
