#include "server/dynamics/contact/demands.h"

#include <algorithm>
#include <numeric>

namespace cradle {
namespace {

/// In a large heap a few contacts carry many times what the others do; one in so many of an
/// island's contacts may sink in deeper than the tolerance.
constexpr int kContactsPerExcused = 500;
/// And one in so many may be preloaded instead: what of its load makes it sink in deeper than the
/// tolerance it carries at once, as far as that lasts. That asks for fewer sub-steps, up to this
/// many times, where it saves a quarter. Contacts are no stiffer by it: with fewer sub-steps, or
/// more contacts preloaded, towers would rock ("Newton's method takes over from soft steps").
constexpr int kContactsPerPreloaded = 8;
/// Where bodies lie on each other by many single points they are no towers: of the points beyond
/// those of a large heap, one in so many more may be preloaded, until they are nearly at rest. As
/// T5 of the benchmark slows down it asks for 7.0 sub-steps instead of 9.3 ("of many single points
/// that move").
constexpr int kPointsPerPreloaded = 4;
constexpr double kMostSaved = 3;
constexpr double kWorthIt = 0.75;

/// Of all sub-steps, what a large heap takes in turmoil. In the mean of eight runs T2 of the
/// benchmark then sinks in by 1.04 mm instead of 1.06, and overlaps by 0.147 m at most instead of
/// 0.145; with half of them by 1.25 mm and 0.162 m. What stands would rock for good, a wall of 465
/// cubes by 4 cm/s, and by 2 cm/s with three in four.
constexpr int kInTurmoil = 3, kOfAll = 5;

int sum(const Demands& demands) {
  return std::accumulate(demands.begin(), demands.begin() + kAsksForNone, 0);
}

/// What all contacts of an island ask for but so many, and so many single points beside them.
int asked_by_all_but(int excused, int excused_points, const Demands& demands,
                     const Demands& of_points) {
  std::size_t choice = kSubSteps.size() - 1;
  for (; choice > 0; --choice) {
    const int points = std::min(excused_points, of_points[choice]);
    excused_points -= points;
    excused -= demands[choice] - points;
    if (excused < 0) break;
  }
  return kSubSteps[choice];
}

}  // namespace

Answer answer_to(const Demands& demands, const Demands& of_points, int least) {
  const int contacts = sum(demands);
  const int points = std::max(sum(of_points) - kLargeHeap, 0) / kPointsPerPreloaded;
  const int all = asked_by_all_but(contacts / kContactsPerExcused, 0, demands, of_points);
  const int most = asked_by_all_but(contacts / kContactsPerPreloaded, points, demands, of_points);
  const int n = *std::ranges::find_if(
      kSubSteps, [&](int choice) { return choice >= most && kMostSaved * choice >= all; });
  const int stiff_as = std::max(n <= kWorthIt * all ? n : all, least);
  const double share = static_cast<double>(stiff_as) / all;  // the rest is made up for by preload
  return {stiff_as, std::max(1 - share * share, 0.0)};
}

int sub_steps_in_turmoil(int stiff_as) { return (kInTurmoil * stiff_as + kOfAll - 1) / kOfAll; }

}  // namespace cradle
