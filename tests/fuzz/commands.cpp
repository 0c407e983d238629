// Random sequences of commands against the core, as the daemon's tick works them off: bytes are
// decoded, put in sequence by the command desk, validated, applied to a small world, which is
// stepped, and answered. Two ledgers say what must come of it.
#include "server/commands.h"

#include "server/command_desk.h"
#include "tests/fuzz/body_ledger.h"
#include "tests/fuzz/command_maker.h"
#include "tests/fuzz/receipt_ledger.h"

namespace cradle::fuzz {
namespace {

// So that an input takes milliseconds.
constexpr int kStepsMax = 48;
constexpr int kDatagramsMax = 256;
constexpr double kTurnMax_rad = 500;  // all bodies: a turn of 0.16 rad is a step of its own
constexpr std::int64_t kBodiesMax = 6;
constexpr std::int64_t kWrenchesMax = 20;

WorldSettings settings(Input& input) {
  static constexpr std::array kRates_hz = {60.0, 240.0, limits::kRateMin_hz, limits::kRateMax_hz};
  static constexpr std::array kSubSteps = {4, 1, 8};
  WorldSettings s;
  s.rate_hz = kRates_hz[input.below(kRates_hz.size())];
  s.sub_steps = kSubSteps[input.below(kSubSteps.size())];
  s.bodies_max = kBodiesMax;
  s.wrenches_max = kWrenchesMax;
  return s;
}

class Run {
 public:
  explicit Run(Input input) : in_(input), world_(settings(in_)) {
    permissions_.shutdown = in_.one_in(2);
    time_.lockstep = in_.one_in(4);
  }

  void go() {
    for (int i = 0; i < kDatagramsMax && !is_expensive() && !in_.is_empty(); ++i) {
      switch (in_.below(8)) {
        case 0:
          tick();
          break;
        case 1:
          arrive_raw();
          break;
        default:
          arrive(make_.command(coming()));
      }
    }
    if (!is_expensive()) tick();
  }

 private:
  Tick coming() const { return world_.tick() + 1; }
  bool is_expensive() const { return steps_ >= kStepsMax || turned_rad_ > kTurnMax_rad; }

  void arrive(const Command& command) {
    RawCommand raw{kind_of(command.body), encode(command)};
    if (in_.one_in(8)) {
      for (std::size_t flips = 1 + in_.below(3); flips > 0; --flips) {
        raw.payload[in_.any<std::uint16_t>() % raw.payload.size()] = in_.any<std::uint8_t>();
      }
    }
    arrive(std::move(raw));
  }

  void arrive_raw() {
    const auto kind =
        static_cast<MessageKind>(in_.below(1 + static_cast<int>(MessageKind::control)));
    const ByteView bytes = in_.take(in_.any<std::uint16_t>());
    arrive({kind, {bytes.begin(), bytes.end()}});
  }

  void arrive(RawCommand raw) {
    receipts_.arrives(raw.kind, raw.payload, coming());
    waiting_.commands.push_back(std::move(raw));
  }

  /// As Daemon::tick.
  void tick() {
    desk_.admit(std::exchange(waiting_, {}), coming(), 0);
    const bool is_stepping = time_.is_stepping(world_.tick());
    const Tick tick = coming();
    for (const Command& command : desk_.take_due(tick, is_stepping)) {
      receipts_.is_due(command.header, tick, is_stepping);
      apply_one(command);
    }
    if (is_stepping) {
      world_.step();
      ++steps_;
      bodies_.check(world_);
      bodies_.check_events(world_);
      turned_rad_ += bodies_.turning_radps() / world_.settings().rate_hz;
    }
    answer_finished_steps();
    receipts_.compare(desk_.take_receipts());
    receipts_.check_waiting(world_.tick());
  }

  void apply_one(const Command& command) {
    const auto before = world_.hash();
    const Outcome outcome = apply(command, world_, time_, permissions_);
    if (outcome.result == Result::ok) {
      bodies_.note(world_, command.body, outcome);
    } else {
      require(world_.hash() == before, "what is refused, or waits, changes nothing");
      bodies_.check_refusal(command.body, outcome);
    }
    bodies_.check(world_);
    bodies_.check_events(world_);
    answer(command.header, outcome,
           outcome.result == Result::queued ? time_.pending.back().until : coming());
  }

  void answer_finished_steps() {
    auto& pending = time_.pending;
    while (!pending.empty() && pending.front().until <= world_.tick()) {
      answer(pending.front().header, {}, pending.front().until);
      pending.erase(pending.begin());
    }
  }

  void answer(const CommandHeader& header, const Outcome& outcome, Tick tick) {
    desk_.answer(header, outcome, tick);
    receipts_.is_answered(header, outcome, tick);
  }

  Input in_;
  World world_;
  CommandDesk desk_{CommandMaker::kEpoch};
  RunState time_;
  Permissions permissions_;
  CommandMaker make_{in_};
  ReceiptLedger receipts_{CommandMaker::kEpoch};
  BodyLedger bodies_;
  Inbox::Contents waiting_;
  int steps_ = 0;
  double turned_rad_ = 0;
};

}  // namespace
}  // namespace cradle::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  cradle::fuzz::Run(cradle::fuzz::Input({data, size})).go();
  return 0;
}
