/// Bodies in contact, divided in space: contacts of different domains are solved side by side, and
/// a processor has the bodies of its domains at hand.
///
/// Domains are the leaves of a tree. A contact is solved with the smallest subtree that has both of
/// its bodies: first all contacts within domains, then level by level those between them. Subtrees
/// of one level share no body.
///
/// Source: nested dissection (George 1973), as an order of contacts instead of unknowns. Small
/// islands share a domain; a large one is halved at the mean of where its bodies are, along the
/// axis along which they lie farthest apart, and each half again. So an island is solved in the
/// same order whatever others there are, and on any number of threads. Cost: O(n) a level, some 5
/// ns a body.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/geometry.h"

namespace cradle {

/// Subtrees by number, level by level: those of one domain come first.
class TaskTree {
 public:
  explicit TaskTree(std::size_t domains = 1) {
    std::size_t begin = 0;
    for (std::size_t width = domains;; width = (width + 1) / 2) {
      begins_[levels_++] = static_cast<std::int32_t>(begin);
      begin += width;
      if (width == 1) break;
    }
    begins_[levels_] = static_cast<std::int32_t>(begin);
  }

  std::size_t levels() const { return levels_; }
  std::int32_t begin(std::size_t level) const { return begins_[level]; }
  std::int32_t end(std::size_t level) const { return begins_[level + 1]; }
  std::size_t tasks() const { return static_cast<std::size_t>(begins_[levels_]); }

  /// The smallest that has both domains.
  std::int32_t of(std::int32_t a, std::int32_t b) const {
    const auto level = static_cast<std::size_t>(std::bit_width(static_cast<std::uint32_t>(a ^ b)));
    return begins_[level] + (a >> level);
  }

 private:
  std::size_t levels_ = 0;
  std::array<std::int32_t, 33> begins_{};
};

/// Keeps its memory from tick to tick.
class Domains {
 public:
  /// An island of kBodies D^2 bodies has D domains, a power of two, of kBodies D each in the mean:
  /// at the ends of a domain's colours lanes stay empty, which is to be little (T2 and T5 of the
  /// benchmark).
  static constexpr int kBodies = 200;

  /// Of bodies by number: the `islands` that they belong to, of which each has so many bodies in
  /// `sizes`, and where they are: `x` is by slot, m.
  void find(std::span<const std::int32_t> slots, std::span<const std::int32_t> islands,
            std::span<const int> sizes, std::span<const Vector> x);

  std::size_t count() const { return count_; }
  /// By place after `sort`, ascending. Empty: there is one.
  std::span<const std::int32_t> by_place() const { return by_place_; }
  /// Where `sort` brings what is by body. Empty: it leaves all as it is.
  std::span<const std::int32_t> places() const { return places_; }
  /// Brings what is by body into the order of domains; otherwise order stays.
  template <class T>
  void sort(std::span<T> values, std::vector<T>& room) const {
    if (count_ == 1) return;
    room.assign(values.begin(), values.end());
    for (std::size_t k = 0; k < room.size(); ++k) {
      values[static_cast<std::size_t>(places_[k])] = room[k];
    }
  }

 private:
  /// While it has more than one domain, with that number; by the first of them.
  struct Subtree {
    std::int32_t domains = 0;
    double bodies = 0;
    Vector sum = Vector::Zero(), squares = Vector::Zero();
    Eigen::Index axis = 0;
    double middle = 0;
  };
  void share_out(std::span<const std::int32_t> slots, std::span<const std::int32_t> islands,
                 std::span<const int> sizes);
  bool halve_all();
  void find_places();

  std::size_t count_ = 1;
  std::vector<std::int32_t> first_;          // domain of each island
  std::vector<std::int32_t> origins_;        // and slot of its first body
  std::vector<std::int32_t> large_, small_;  // islands
  std::vector<std::int32_t> domains_;        // by body
  std::vector<std::int32_t> places_, by_place_;
  std::vector<Vector> points_;  // m, by body, about the first one of its island
  std::vector<Subtree> subtrees_;
  std::vector<std::int32_t> begins_;
};

}  // namespace cradle
