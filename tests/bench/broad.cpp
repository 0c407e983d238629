#include "tests/bench/broad.h"

#include <algorithm>
#include <iterator>

#include "tests/bench/box_scene.h"
#include "tests/bench/table.h"

namespace cradle::bench {
namespace {

void leap(BoxScene& scene, std::size_t /*moving*/) {
  scene = drifting_boxes(scene.boxes.size(), scene.random());
}

void free_drift(BoxScene& scene, std::size_t moving) {
  for (std::size_t i = 0; i < moving; ++i) scene.move(i, scene.velocities[i]);
}

void to_one_point(BoxScene& scene) {
  for (Aabb& box : scene.boxes) box = {Vector::Zero(), Vector::Ones()};
}

void one_huge(BoxScene& scene) {
  scene.boxes.front() = {Vector::Constant(-1e3), Vector::Constant(1e3)};
}

void to_lines(BoxScene& scene) {
  for (std::size_t i = 0; i < scene.boxes.size(); ++i) {
    Vector along = Vector::Zero();
    along[static_cast<Eigen::Index>(i % 3)] = static_cast<double>(i);
    scene.move(i, along - 0.5 * (scene.boxes[i].lower + scene.boxes[i].upper));
  }
}

void all_sizes(BoxScene& scene) {
  for (Aabb& box : scene.boxes) {
    const Vector middle = 0.5 * (box.lower + box.upper);
    const double factor = std::exp(scene.uniform(-1.5, 1.0));
    box = {middle + factor * (box.lower - middle), middle + factor * (box.upper - middle)};
  }
}

constexpr BroadCase kBroadCases[] = {
    {"broad:100", 100, 1, 2000, 1000, nullptr, drift, "all of 100 bodies move"},
    {"broad:1k", 1'000, 1, 1000, 400, nullptr, drift, "all of 1000 bodies move"},
    {"broad:10k", 10'000, 1, 400, 200, nullptr, drift, "all of 10 000 bodies move"},
    {"broad:100k", 100'000, 1, 200, 60, nullptr, drift, "all of 100 000 bodies move"},
    {"broad:100-5%", 100, 0.05, 2000, 1000, nullptr, drift, "5 of 100 bodies move"},
    {"broad:1k-5%", 1'000, 0.05, 1000, 400, nullptr, drift, "50 of 1000 bodies move"},
    {"broad:10k-5%", 10'000, 0.05, 400, 200, nullptr, drift, "500 of 10 000 bodies move"},
    {"broad:100k-5%", 100'000, 0.05, 200, 60, nullptr, drift, "5000 of 100 000 bodies move"},
    {"broad:long", 10'000, 1, 10'000, 100, nullptr, drift, "ten thousand steps"},
    {"broad:sizes", 10'000, 1, 400, 100, all_sizes, drift, "sizes of one to twelve"},
    {"broad:leap", 10'000, 1, 60, 20, nullptr, leap, "all are elsewhere in each step"},
    {"broad:huge", 10'000, 1, 200, 60, one_huge, drift, "one huge body over all others"},
    {"broad:lines", 10'000, 1, 200, 60, to_lines, free_drift, "a line along each axis"},
    {"broad:point", 10'000, 1, 20, 5, to_one_point, free_drift, "all in one point"},
};

std::int64_t count_differing(const std::vector<BodyPair>& a, const std::vector<BodyPair>& b) {
  std::vector<BodyPair> only_one;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(),
                                std::back_inserter(only_one));
  return static_cast<std::int64_t>(only_one.size());
}

constexpr Column kBroadColumns[] = {{"scene", 13},
                                    {"method", 6},
                                    {"bodies", 6},
                                    {"moving", 6},
                                    {"ns_per_body", 11},
                                    {"median", 6},
                                    {"p99", 6},
                                    {"late", 6},
                                    {"fcl_ns_per_body", 15},
                                    {"ratio", 6},
                                    {"pairs_per_body", 14},
                                    {"work_per_body", 13},
                                    {"differing", 9},
                                    {"crowded", 7}};

}  // namespace

std::span<const BroadCase> broad_cases() { return kBroadCases; }

BroadRow run(const BroadCase& which) {
  BoxScene scene = drifting_boxes(which.bodies);
  if (which.arrange != nullptr) which.arrange(scene);
  const auto moving = static_cast<std::size_t>(which.moving * static_cast<double>(which.bodies));
  const auto ours = make_broad_phase(broad_phase_names().front());
  const auto fcl = make_fcl_broad_phase();
  BroadRow row;
  row.name = which.name;
  row.bodies = which.bodies;
  row.moving = which.moving;
  std::vector<double> us, fcl_us;
  std::vector<BodyPair> pairs, fcl_pairs;
  double pair_sum = 0, work_sum = 0;
  for (int step = 0; step < which.steps; ++step) {
    which.step(scene, moving);
    {
      const Stopwatch stopwatch;
      const BroadPhaseReport report = ours->find_pairs(scene.input(), pairs);
      us.push_back(stopwatch.elapsed_us());
      row.method = report.method;
      row.crowded = report.crowded;
      work_sum += static_cast<double>(report.boxes_seen + report.nodes_seen);
    }
    pair_sum += static_cast<double>(pairs.size());
    if (step >= which.fcl_steps) continue;
    const Stopwatch stopwatch;
    fcl->find_pairs(scene.input(), fcl_pairs);
    fcl_us.push_back(stopwatch.elapsed_us());
    row.differing += count_differing(pairs, fcl_pairs);
  }
  const double body_steps = static_cast<double>(which.bodies) * which.steps;
  row.pairs_per_body = pair_sum / body_steps;
  row.work_per_body = work_sum / body_steps;
  row.late_us_per_step = summarise({us.end() - which.steps / 10, us.end()});
  row.us_per_step = summarise(std::move(us));
  row.fcl_us_per_step = summarise(std::move(fcl_us));
  return row;
}

std::string broad_header(Format format) { return names_line(kBroadColumns, format); }

std::string line(Format format, const BroadRow& row) {
  const auto text = [&](double value) { return text_of(value, format); };
  const auto ns = [&](double us) { return text(1e3 * us / static_cast<double>(row.bodies)); };
  return cells_line(
      kBroadColumns,
      {row.name, row.method, std::to_string(row.bodies), text(row.moving),
       ns(row.us_per_step.mean_us), ns(row.us_per_step.median_us), ns(row.us_per_step.p99_us),
       ns(row.late_us_per_step.mean_us), ns(row.fcl_us_per_step.mean_us),
       text(row.fcl_us_per_step.mean_us / row.us_per_step.mean_us), text(row.pairs_per_body),
       text(row.work_per_body), std::to_string(row.differing), std::to_string(row.crowded)},
      format);
}

}  // namespace cradle::bench
