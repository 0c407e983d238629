#include "server/dynamics/contact/demands.h"

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
/// In a heap of this many that lie on each other by points there are no towers, and every third may
/// be preloaded: T5 of the benchmark takes 0.94 of the time, in 6.7 sub-steps as it comes to rest
/// instead of 9.4.
constexpr int kLoosePerPreloaded = 3, kLoose = 500;
constexpr double kMostSaved = 3;
constexpr double kWorthIt = 0.75;

/// What all contacts of an island ask for but one in so many.
int asked_by_all_but(int contacts_per_one, const Demands& demands) {
  int excused = std::accumulate(demands.begin(), demands.end(), 0) / contacts_per_one;
  std::size_t choice = kSubSteps.size() - 1;
  while (choice > 0 && demands[choice] <= excused) excused -= demands[choice--];
  return kSubSteps[choice];
}

}  // namespace

Answer answer_to(const Demands& demands, int least, bool is_loose) {
  const bool is_loose_heap =
      is_loose && std::accumulate(demands.begin(), demands.end(), 0) >= kLoose;
  const int all = asked_by_all_but(kContactsPerExcused, demands);
  const int most =
      asked_by_all_but(is_loose_heap ? kLoosePerPreloaded : kContactsPerPreloaded, demands);
  const int n = *std::ranges::find_if(
      kSubSteps, [&](int choice) { return choice >= most && kMostSaved * choice >= all; });
  const int sub_steps = std::max(n <= kWorthIt * all ? n : all, least);
  const double share = static_cast<double>(sub_steps) / all;  // the rest is made up for by preload
  return {sub_steps, std::max(1 - share * share, 0.0)};
}

}  // namespace cradle
