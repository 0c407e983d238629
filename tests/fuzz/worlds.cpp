// Random worlds, as a scene may make them: of any settings, with geometry, drag and springs, which
// no command can give. Each is a twin: the other one computes with other lanes, another broad phase
// and tasks cut anywhere, in another order, and must be the same to the bit after every step.
#include <random>

#include "server/collision/broad_phase.h"
#include "server/collision/executor.h"
#include "server/collision/machine_lanes.h"
#include "server/collision/stored_geometry.h"
#include "tests/fuzz/body_ledger.h"
#include "tests/fuzz/value_maker.h"

namespace cradle::fuzz {
namespace {

// So that an input takes milliseconds.
constexpr int kStepsMax = 24;
constexpr int kActionsMax = 48;
constexpr int kSpringPartsMax = 50;   // of ticks that springs have halved in vain
constexpr double kTurnMax_rad = 500;  // all bodies: a turn of 0.14 rad is a step of its own
constexpr std::int64_t kBodiesMax = 8;
constexpr std::int64_t kWrenchesMax = 6;

WorldSettings settings(Input& in) {
  static constexpr std::array kRates_hz = {60.0, 240.0, 20.0, limits::kRateMin_hz};
  static constexpr std::array kSubSteps = {0, 1, 4, 8};
  static constexpr std::array kTolerances_m = {0.0005, 0.005, 1e-5};
  const auto one_of = [&in](const auto& values) { return values[in.below(values.size())]; };
  WorldSettings s;
  s.rate_hz = one_of(kRates_hz);
  if (in.one_in(2)) s.sub_steps = one_of(kSubSteps);
  s.contact_tolerance_m = one_of(kTolerances_m);
  s.collides_twice = in.one_in(4);
  s.is_planar = in.one_in(4);
  if (s.is_planar) s.gravity_W = {0, -9.81, 0};
  s.is_sleeping = !in.one_in(4);
  s.balance_every = static_cast<int>(in.below(3));
  s.balance_flight = in.one_in(4);
  if (in.one_in(2)) s.solver = one_of(solver_names());
  if (in.one_in(4)) s.scheme = one_of(scheme_names());
  s.is_full = in.one_in(16);
  s.bodies_max = kBodiesMax;
  s.wrenches_max = kWrenchesMax;
  return s;
}

WorldSettings of_twin(WorldSettings s, Input& in) {
  const std::vector<std::string> names = broad_phase_names();
  s.broad_phase = names[in.below(names.size())];
  s.lanes = machine_lanes()[in.below(machine_lanes().size())];
  return s;
}

/// Whatever a task may be asked for: cut anywhere, the last range first.
class Shuffled final : public Executor {
 public:
  void for_ranges(int count, int, RangeTask task) override {
    for (int end = count; end > 0;) {
      const int begin = end - 1 - static_cast<int>(random_() % static_cast<unsigned>(end));
      task(begin, end);
      end = begin;
    }
  }
  int threads() const override { return 3; }

 private:
  std::minstd_rand random_{1};
};

/// What bodies may name: a hull, a solid mesh, a compound and ground, about as large as bodies are.
std::vector<GeometryPointer> geometries(bool is_planar) {
  if (is_planar) {
    const std::array<Vec2, 5> corners = {{{-1, -1}, {1, -1}, {1.5, 0}, {0.5, 1}, {-1, 0.5}}};
    return {make_polygon(corners).geometry};
  }
  const std::vector<Vector> corners = {{-1, -1, -0.5}, {1, -1, -0.5}, {0, 1.5, -0.5}, {0, 0, 1}};
  const std::vector<Triangle> sides = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  CompoundPart bar{Shape::box({1, 0.25, 0.25}), {}}, knob{Shape::sphere(0.5), {}};
  knob.p_BoPo = {1, 0, 0.5};
  std::vector<double> heights;
  for (int k = 0; k < 7 * 7; ++k) heights.push_back(0.5 * std::sin(1.7 * k));
  return {make_hull(corners).geometry, make_mesh(corners, sides).geometry,
          make_compound({bar, knob}).geometry,
          make_height_field(7, 7, 2, 2, std::move(heights)).geometry};
}

class Run {
 public:
  explicit Run(Input input)
      : in_(input), world_(settings(in_)), twin_(of_twin(world_.settings(), in_)) {
    for (const GeometryPointer& geometry : geometries(world_.settings().is_planar)) {
      require(world_.add_geometry(geometry) == twin_.add_geometry(geometry), "numbers of geometry");
    }
  }

  void go() {
    for (int i = 0; i < kActionsMax && !is_expensive() && !in_.is_empty(); ++i) act();
    if (!is_expensive()) step(4);
  }

 private:
  bool is_expensive() const {
    return steps_ >= kStepsMax || turned_rad_ > kTurnMax_rad || spring_parts_ > kSpringPartsMax;
  }

  void act() {
    switch (in_.below(16)) {
      case 0:
      case 1:
      case 2:
      case 3:
        return change(Spawn{{make_.spec()}});
      case 4:
        return change(Despawn{{make_.body_id()}});
      case 5:
        return change(Push{{make_.wrench()}});
      case 6:
        return change(SetMotion{{make_.motion()}});
      case 7:
        return change(SetGravity{make_.vector()});
      case 8:
        return drag();
      case 9:
        return spring();
      default:
        return step(1 + static_cast<int>(in_.below(4)));
    }
  }

  static Outcome apply(World& world, const CommandBody& command) {
    if (const auto* c = std::get_if<Spawn>(&command)) return world.spawn(c->bodies);
    if (const auto* c = std::get_if<Despawn>(&command)) return world.despawn(c->bodies);
    if (const auto* c = std::get_if<Push>(&command)) return world.push(c->wrenches);
    if (const auto* c = std::get_if<SetMotion>(&command)) return world.set_motion(c->motions);
    return world.set_gravity(std::get<SetGravity>(command).gravity_W);
  }

  void change(const CommandBody& command) {
    const Outcome outcome = apply(world_, command);
    require(outcome == apply(twin_, command), "twins answer alike");
    if (outcome.result == Result::ok) {
      bodies_.note(world_, command, outcome);
    } else {
      bodies_.check_refusal(command, outcome);
    }
    check();
  }

  void drag() {
    const BodyId body = make_.body_id();
    const Drag drag{make_.positive(), make_.positive(), make_.positive()};
    require(world_.set_drag(body, drag) == twin_.set_drag(body, drag), "twins answer alike");
    check();
  }

  void spring() {
    Spring spring{make_.body_id(), {}, make_.vector(), make_.vector(), 0, 0, 0};
    if (in_.one_in(2)) spring.b = make_.body_id();
    spring.stiffness = 16 * make_.positive();
    spring.damping = make_.positive();
    spring.rest_length = make_.positive();
    const std::array springs = {spring};
    require(world_.add_springs(springs) == twin_.add_springs(springs), "twins answer alike");
    check();
  }

  void step(int count) {
    for (; count > 0 && !is_expensive(); --count) {
      spring_parts_ += world_.step().springs_unconverged;
      twin_.step(shuffled_);
      ++steps_;
      check();
      turned_rad_ += bodies_.turning_radps() / world_.settings().rate_hz;
    }
  }

  void check() {
    bodies_.check(world_);
    bodies_.check_events(world_);
    twin_.take_events();
    require(world_.hash() == twin_.hash(), "twins are the same to the bit");
  }

  Input in_;
  World world_, twin_;
  Shuffled shuffled_;
  ValueMaker make_{in_, true};
  BodyLedger bodies_;
  int steps_ = 0, spring_parts_ = 0;
  double turned_rad_ = 0;
};

}  // namespace
}  // namespace cradle::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  cradle::fuzz::Run(cradle::fuzz::Input({data, size})).go();
  return 0;
}
