/// Where two support features lie over each other, as contact points. Private to this folder.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "server/collision/manifold.h"
#include "server/collision/support_feature.h"

namespace cradle {

/// A point of contact in the frame F whose z is the normal from A to B.
struct FeatureContact {
  Vector p;       ///< x, y across the normal; z: the separation, m
  double height;  ///< of the point midway between the surfaces along z, m
  std::uint32_t name;
  /// Between two sharp edges, which are taken to fall away by 45 degrees, but so far from both that
  /// it may be outside of the bodies by more than its separation tells.
  bool is_guess;
};

/// At most two for each edge of one feature and one for each corner of the other.
struct FeatureContacts {
  std::array<FeatureContact, 3 * SupportFeature::kCornersMax>
      items;  // not cleared: that takes time
  std::size_t count = 0;
  double steepness = 0;  ///< what a separation changes by at most as the features slide, m / m
  bool B_names = false;  ///< a point at a corner of both is named by that of B, not that of A

  void add(double x, double y, double z_A, double z_B, std::uint32_t name) {
    items[count++] = {{x, y, z_B - z_A}, 0.5 * (z_A + z_B), name, false};
  }
  /// The first that near, as seen along z; or `count`.
  std::size_t find(double distance, double x, double y) const {
    const auto is_near = [&](const FeatureContact& c) {
      return std::abs(c.p.x() - x) <= distance && std::abs(c.p.y() - y) <= distance;
    };
    return static_cast<std::size_t>(std::find_if(items.begin(), items.begin() + count, is_near) -
                                    items.begin());
  }
  bool any_within(double distance, double x, double y) const {
    return find(distance, x, y) < count;
  }
  /// The place of the one with that name; or `count`.
  std::size_t find(std::uint32_t name) const {
    const auto is_it = [name](const FeatureContact& c) { return c.name == name; };
    return static_cast<std::size_t>(std::find_if(items.begin(), items.begin() + count, is_it) -
                                    items.begin());
  }
  std::span<FeatureContact> used() { return std::span(items).first(count); }
};

/// Of a point in F where the features touch: by the corner that is there, as seen along z and up to
/// `slack` (m), however many corners each feature has; else `otherwise`. `B_first`: where both have
/// a corner, by that of B.
std::uint32_t name_of_point(const SupportFeature& A, const SupportFeature& B, bool B_first,
                            double x, double y, double slack, std::uint32_t otherwise);

/// Whether a feature in F is a face that lies across z.
bool is_flush(const SupportFeature& face);

/// Leaves of a feature in F its highest edge, if that is level, or else its highest corner; of
/// several at one height any. `up` is 1, or -1 where the highest is the lowest.
void keep_highest(SupportFeature& feature, double up);

/// Of two faces in F that are flush and have a point in common as seen along z: `p`, if it is one
/// but for `slack` (m). Else, if one is a disc, that of the other nearest to the disc's middle.
Vector common_point(const SupportFeature& A, const SupportFeature& B, const Vector& p,
                    double slack);

/// The corners of the area in which the features overlap as seen along z, with the separation
/// there. Both features are in F; a face of A looks along z, one of B against it. A corner up to
/// `slack` (m) outside counts as inside. Exact but for that, and for the octagons that stand for
/// discs where these meet faces; those of level discs are turned.
void overlap_features(SupportFeature& A, SupportFeature& B, double slack,
                      FeatureContacts& contacts);

}  // namespace cradle
