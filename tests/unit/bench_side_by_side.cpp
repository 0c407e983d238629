// Runs beside peers: what fails is told, nothing that came out wrong is dropped.
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <thread>

#include "tests/bench/in_child.h"
#include "tests/bench/side_by_side.h"

using namespace cradle;
using namespace cradle::bench;

namespace {

/// Bodies that stay where they are.
class Still : public Peer {
 public:
  void add(const BodySpec& body, const BodyMass&, const StoredGeometry*) override {
    BodyState& state = states_.emplace_back();
    state.p_WBo = body.p_WBo;
    state.q_WB = body.q_WB;
  }
  void step() override {}
  BodyState state(std::size_t number) const override { return states_[number]; }

 protected:
  std::vector<BodyState> states_;
};
class Lost : public Still {
  void step() override { states_[0].p_WBo.z = std::nan(""); }
};
class Crashing : public Still {
  void step() override { std::abort(); }
};
class Refusing : public Still {
  void add(const BodySpec&, const BodyMass&, const StoredGeometry*) override {
    throw PeerError("no such shape");
  }
};

template <class One>
PeerLibrary library_of() {
  return {"other", "libother-dev", 7,
          [](const WorldSettings&, const PeerSettings&) -> std::unique_ptr<Peer> {
            return std::make_unique<One>();
          }};
}

long commas(const std::string& text) { return std::ranges::count(text, ','); }

}  // namespace

TEST_CASE("what a child returns comes back whole, and how it ends otherwise is told") {
  const std::string long_one(300'000, 'x');
  CHECK(in_child([&] { return long_one; }).text == long_one);
  CHECK(in_child([] { return std::string(); }).is_done);

  const auto says = [](auto work, double limit_s = 600) {
    const ChildResult result = in_child(work, limit_s);
    CHECK_FALSE(result.is_done);
    return result.text;
  };
  CHECK(says([]() -> std::string { throw std::runtime_error("why"); }) == "failed: why");
  CHECK(says([]() -> std::string { std::abort(); }) == "crashed: Aborted");
  CHECK(says([]() -> std::string { _exit(0); }) == "crashed: it ended by itself");
  CHECK(says(
            []() -> std::string {
              for (;;) pause();
            },
            0.2) == "no end in 0 s");
}

TEST_CASE("children run one at a time, and go on when each of the others has had its turn") {
  // What each says is where the tape was when its turns began: it takes a while for each.
  void* const shared =
      mmap(nullptr, sizeof(int), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  REQUIRE(shared != MAP_FAILED);
  int& tape = *static_cast<int*>(shared);
  const auto turns = [&](int number) {
    return [&tape, number](const PassOn& pass_on) {
      std::string seen;
      for (int turn = 0; turn < number; ++turn) {
        if (turn > 0) pass_on();
        const int before = tape;
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        seen += std::to_string(before) + (tape == before ? " " : "! ");
        tape = before + 1;
      }
      return seen;
    };
  };
  const ChildWork dies = [](const PassOn& pass_on) -> std::string {
    pass_on();
    std::abort();
  };
  const std::vector<ChildWork> works{turns(4), dies, turns(2), turns(3)};
  const std::vector<ChildResult> results = in_children(works);
  REQUIRE(results.size() == 4);
  CHECK(results[0].text == "0 3 6 8 ");
  CHECK(results[1].text == "crashed: Aborted");
  CHECK(results[2].text == "1 4 ");
  CHECK(results[3].text == "2 5 7 ");
  munmap(shared, sizeof(int));
}

TEST_CASE("a peer that crashes or has no such shape is a row, and the others go on") {
  const std::vector<PeerLibrary> libraries{library_of<Crashing>(), library_of<Refusing>(),
                                           library_of<Still>()};
  const SideBySide result = compare(*find_case("A1"), scene_of(*find_case("A1")), {}, libraries, 1);
  REQUIRE(result.engines.size() == 4);
  CHECK(result.engines[0].is_ok());
  CHECK(result.engines[0].row.error < 1e-9);
  CHECK(result.engines[1].outcome == "crashed: Aborted");
  CHECK(std::isnan(result.engines[1].row.error));
  CHECK_FALSE(result.engines[1].ratio);
  CHECK(result.engines[2].outcome == "failed: no such shape");
  CHECK(result.engines[3].is_ok());
  // What stays at the origin is farthest from (10 t, 0, 50 t - 9.81 t^2 / 2) at t = 5.5.
  CHECK(result.engines[3].row.error == Approx(138.06).epsilon(1e-4));
  CHECK(result.engines[0].ratio.value() == 1);
  CHECK(result.engines[3].ratio.value() == Approx(time_us(*result.which, result.engines[0].row) /
                                                  time_us(*result.which, result.engines[3].row)));
}

TEST_CASE("a peer whose numbers are none has the error NaN, not none") {
  const SideBySide result =
      compare(*find_case("A1"), scene_of(*find_case("A1")), {}, std::vector{library_of<Lost>()}, 3);
  CHECK(result.engines[1].is_ok());
  CHECK(std::isnan(result.engines[1].row.error));
  CHECK(peers_lines(Format::table, result).find(" nan ") != std::string::npos);
}

TEST_CASE("a comparison is a line of the table, and of CSV a line an engine") {
  const std::vector<PeerLibrary> libraries{library_of<Still>(), library_of<Crashing>()};
  const SideBySide result =
      compare(*find_case("A12"), scene_of(*find_case("A12")), {}, libraries, 1);

  const std::string header = peers_header(Format::csv, libraries);
  const std::string csv = peers_lines(Format::csv, result);
  CHECK(std::ranges::count(csv, '\n') == 3);
  CHECK(commas(csv) == 3 * (commas(header) + 1));  // one in "max speed, m/s"
  CHECK(csv.find("A12,cradle,hybrid,") == 0);
  CHECK(csv.find("\nA12,other,7 it,") != std::string::npos);
  CHECK(csv.find(",ok,1\n") != std::string::npos);
  CHECK(csv.find(",crashed: Aborted,\n") != std::string::npos);

  const std::string names = peers_header(Format::table, libraries);
  const std::string table = peers_lines(Format::table, result);
  CHECK(std::ranges::count(table, '\n') == 1);
  CHECK(table.find("max speed, m/s") == names.find("error_kind"));
  CHECK(table.find("crashed") != std::string::npos);
}

TEST_CASE("of three runs the middle one is told, with the worst error of all") {
  // Every run is a process of its own: what differs between them is the time.
  const SideBySide result = compare(*find_case("A9"), scene_of(*find_case("A9")), {},
                                    std::vector{library_of<Still>()}, 3);
  CHECK(result.engines[0].row.hash == run(*find_case("A9"), {}).hash);
  CHECK(result.engines[0].row.error == run(*find_case("A9"), {}).error);
  CHECK(result.engines[1].row.error == 1);  // the sphere that came stands: (1, 0, 0, 0, 0) stays 0
}

TEST_CASE("peers refuse what they would get wrong") {
  const Scene spring = parse_scene(R"(
    [[body]]
    name = "ball"
    shape = "sphere"
    radius_m = 1
    [[spring]]
    body_a = "ball"
    stiffness_npm = 1)",
                                   "spring");
  CHECK_THROWS_WITH(make_peer(library_of<Still>(), spring, {}), "peers are not given springs");
  const Scene moved = parse_scene(R"(
    [[body]]
    shape = "sphere"
    radius_m = 1
    centre_of_mass_m = [0.1, 0, 0])",
                                  "moved");
  CHECK_THROWS_WITH(make_peer(library_of<Still>(), moved, {}), Catch::Contains("centre of mass"));
}
