#include "tests/bench/pair.h"

#include <algorithm>

#include "server/collision/narrow_phase.h"
#include "server/stopwatch.h"
#include "tests/bench/fcl_oracle.h"
#include "tests/bench/measure.h"
#include "tests/bench/parting.h"
#include "tests/bench/table.h"

namespace cradle::bench {
namespace {

// As many poses as branch prediction cannot learn by heart.
constexpr std::size_t kPoses = 400;
constexpr int kPairRounds = 15;

/// Adds to the figures what was found in a pose.
void judge(PairFigures& figures, const Pair& pair, const Parting& best, const Vector& n,
           double separation, int points, bool is_distance) {
  figures.points += points;
  if (points == 0) {
    figures.missed += 1;
    return;
  }
  // At a corner the nearest points tell the direction badly, the distance well.
  const double truth = is_distance ? best.overlap : overlap(pair, n);
  figures.error_m = worse(std::abs(separation + truth), figures.error_m);
  figures.excess_m = worse(overlap(pair, n) - best.overlap, figures.excess_m);
}

void finish(PairFigures& figures, double poses) {
  figures.points /= poses;
  figures.missed /= poses;
}

/// As in a tick: boxes many at a time.
class Points final : public MadeManifolds {
 public:
  void find(std::span<const Pair> pairs) {
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const Pair& pair = pairs[k];
      many_.add(k, {pair.A.shape, pair.X_WA, pair.A.geometry.get()},
                {pair.B.shape, pair.X_WB, pair.B.geometry.get()}, kPairMargin);
    }
    many_.finish();
  }
  Manifold& room(std::size_t) override { return room_; }
  void take(std::size_t, const Manifold& made) override { sum_ += made.count; }
  int sum() const { return sum_; }

 private:
  Collisions many_{*this};
  Manifold room_;
  int sum_ = 0;
};

double time_ours(std::span<const Pair> pairs) {
  std::vector<double> us;
  Points points;
  for (int round = 0; round < kPairRounds; ++round) {
    const Stopwatch stopwatch;
    points.find(pairs);
    us.push_back(stopwatch.elapsed_us());
  }
  volatile int sink = points.sum();
  (void)sink;
  return 1e3 * summarise(std::move(us)).median_us / static_cast<double>(pairs.size());
}

PairFigures figures_of_ours(std::span<const Pair> pairs, std::span<const Parting> best) {
  PairFigures figures;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const Manifold manifold = pairs[k].collide(kPairMargin);
    judge(figures, pairs[k], best[k], manifold.normal_W, -deepest(manifold), manifold.count, false);
  }
  finish(figures, static_cast<double>(pairs.size()));
  figures.ns = time_ours(pairs);
  return figures;
}

std::optional<PairFigures> figures_of_fcl(std::span<const Pair> pairs,
                                          std::span<const Parting> best, FclQuestion question) {
  if (!can_ask_fcl(pairs.front(), question)) return std::nullopt;
  PairFigures figures;
  const std::vector<FclAnswer> answers = ask_fcl(pairs, question);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const FclAnswer& answer = answers[k];
    if (answer.end != FclEnd::End::answered) return std::nullopt;
    const bool is_usable = answer.points > 0 && answer.n.norm() > 0.5;
    judge(figures, pairs[k], best[k], answer.n, answer.separation, is_usable ? answer.points : 0,
          question != FclQuestion::contacts);
  }
  finish(figures, static_cast<double>(pairs.size()));
  const auto ns = time_fcl(pairs, question);
  if (!ns) return std::nullopt;
  figures.ns = *ns;
  return figures;
}

constexpr Column kPairColumns[] = {{"pair", 25},       {"situation", 9},    {"ns", 6},
                                   {"points", 6},      {"missed", 6},       {"error_m", 9},
                                   {"excess_m", 9},    {"fcl_ns", 6},       {"fcl_points", 10},
                                   {"fcl_missed", 10}, {"fcl_error_m", 11}, {"fcl_excess_m", 12}};

std::vector<PairCase> all_pairs() {
  std::vector<PairCase> cases;
  for (int a = 0; a < kPairShapes; ++a) {
    for (int b = a; b < kPairShapes; ++b) {
      const auto A = static_cast<PairShape>(a), B = static_cast<PairShape>(b);
      if (A == PairShape::half_space) continue;
      cases.push_back({"pair:" + std::string(word_of(A)) + "-" + std::string(word_of(B)), A, B});
    }
  }
  return cases;
}

}  // namespace

const std::vector<PairCase>& pair_cases() {
  static const std::vector<PairCase> kCases = all_pairs();
  return kCases;
}

std::vector<PairRow> run(const PairCase& which) {
  std::vector<PairRow> rows;
  for (const Situation situation : kSituations) {
    const std::vector<Pair> pairs = pairs_in(which.A, which.B, situation, kPoses);
    std::vector<Parting> best;
    for (const Pair& pair : pairs) best.push_back(parting(pair));
    // FCL finds no contacts of bodies apart; its distance is what it has for them.
    const FclQuestion question =
        situation == Situation::apart ? FclQuestion::distance : FclQuestion::contacts;
    rows.push_back({which.name, situation, figures_of_ours(pairs, best),
                    figures_of_fcl(pairs, best, question)});
  }
  return rows;
}

std::string pair_header(Format format) { return names_line(kPairColumns, format); }

std::string line(Format format, const PairRow& row) {
  std::vector<std::string> cells{row.name, std::string(word_of(row.situation))};
  const auto add = [&](const std::optional<PairFigures>& f) {
    const auto text = [&](double PairFigures::*which) {
      return f ? text_of((*f).*which, format) : std::string("-");
    };
    for (const auto which : {&PairFigures::ns, &PairFigures::points, &PairFigures::missed,
                             &PairFigures::error_m, &PairFigures::excess_m}) {
      cells.push_back(text(which));
    }
  };
  add(row.ours);
  add(row.fcl);
  return cells_line(kPairColumns, cells, format);
}

}  // namespace cradle::bench
