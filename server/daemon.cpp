#include "server/daemon.h"

#include <cradle/limits.h>
#include <cradle/version.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <utility>

#include "server/collision/narrow_phase.h"
#include "server/thread_pool.h"

namespace cradle {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kStatusPeriod_us = 500'000;
// Names and shapes for newcomers: 6400 bodies a second.
constexpr int kDescriptions = 64;
constexpr std::int64_t kDescriptionPeriod_us = 10'000;

std::int64_t new_epoch() {
  std::random_device device;
  return std::uniform_int_distribution<std::int64_t>(1, limits::kIntegerMax)(device);
}

}  // namespace

/// Measures the wall time of one tick's phases, and adds it to the sums when the tick is over.
class Daemon::PhaseTimer final : public StepObserver {
 public:
  PhaseTimer(Times& sums, TickHistograms& histograms) : sums_(sums), histograms_(histograms) {
    enter(tick_.apply_us);
  }
  ~PhaseTimer() override {
    leave();
    sums_.apply_us += tick_.apply_us;
    sums_.collide_us += tick_.collide_us;
    sums_.solve_us += tick_.solve_us;
    sums_.publish_us += tick_.publish_us;
    sums_.ticks += tick_.ticks;
    if (tick_.ticks == 0) return;  // the world stood still
    histograms_.apply.add(1e-6 * tick_.apply_us);
    histograms_.collide.add(1e-6 * tick_.collide_us);
    histograms_.solve.add(1e-6 * tick_.solve_us);
    histograms_.publish.add(1e-6 * tick_.publish_us);
    histograms_.whole.add(1e-6 *
                          (tick_.apply_us + tick_.collide_us + tick_.solve_us + tick_.publish_us));
  }

  void enter(Phase phase) override {
    tick_.ticks = 1;
    enter(phase == Phase::collide ? tick_.collide_us : tick_.solve_us);
  }
  void publish() { enter(tick_.publish_us); }

 private:
  void enter(double& phase_us) {
    leave();
    current_ = &phase_us;
  }
  void leave() {
    const auto now = Pacer::Clock::now();
    if (current_ != nullptr) {
      *current_ += std::chrono::duration<double, std::micro>(now - begin_).count();
    }
    begin_ = now;
  }

  Times& sums_;
  TickHistograms& histograms_;
  Times tick_;
  double* current_ = nullptr;
  Pacer::Clock::time_point begin_{};
};

Daemon::Daemon(const Options& options, Scene scene, std::unique_ptr<Transport> control,
               std::unique_ptr<Transport> states)
    : options_(options),
      epoch_(new_epoch()),
      channels_(options.world),
      control_(std::move(control)),
      states_(std::move(states)),
      run_(std::move(scene)),
      desk_(epoch_),
      journal_(std::make_unique<NoJournal>()),
      publisher_(*states_, channels_, options.datagram_bytes,
                 std::chrono::microseconds(
                     static_cast<std::int64_t>(1e6 / run_.world().settings().rate_hz))),
      pacer_(run_.world().settings().rate_hz, Pacer::Clock::now()) {
  time_.lockstep = options.lockstep;
  if (options.threads > 1) {
    executor_ = std::make_unique<ThreadPool>(options.threads);
  } else {
    executor_ = std::make_unique<SerialExecutor>();
  }
  for (Event& event : run_.world().take_events()) tell(std::move(event));
}

Daemon::~Daemon() = default;

std::int64_t Daemon::now_us() const {
  const auto since_start = Pacer::Clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(since_start).count();
}

Daemon::Presence Daemon::look_around(bool waits_for_rivals) {
  Presence presence;
  const auto begin = Pacer::Clock::now();
  const auto patience =
      waits_for_rivals ? std::chrono::microseconds(kStatusPeriod_us) + 100ms : 0us;
  const auto is_done = [&] {
    const auto waited = Pacer::Clock::now() - begin;
    return presence.has_rival || waited >= (presence.hears_itself ? patience : 1s);
  };
  while (!is_done()) {
    if (!presence.hears_itself) {
      control_->send(channels_.name(MessageKind::status), encode(status()));
    }
    control_->receive(50ms, [&](std::string_view channel, ByteView payload) {
      if (channel != channels_.name(MessageKind::status)) return;
      const auto heard = decode_status(payload);
      if (heard) (heard->epoch == epoch_ ? presence.hears_itself : presence.has_rival) = true;
    });
  }
  return presence;
}

/// The receive thread, for as long as the loop runs, however that ends.
class Daemon::Receiver {
 public:
  explicit Receiver(Daemon& daemon) : thread_([this, &daemon] { daemon.receive(is_ending_); }) {}
  ~Receiver() {
    is_ending_ = true;
    thread_.join();
  }
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;

 private:
  std::atomic<bool> is_ending_ = false;
  std::thread thread_;
};

void Daemon::run(Supervisor& supervisor) {
  supervisor_ = &supervisor;
  Receiver receiver(*this);
  pacer_.restart(Pacer::Clock::now());
  while (!time_.shutdown) {
    if (options_.board != nullptr) put_readings();
    const Awoken awoken = wait();
    if (awoken == Awoken::supervisor) {
      if (!supervisor.attend()) break;
    } else if (awoken == Awoken::news) {
      send_news();
    } else {
      tick(awoken == Awoken::tick);
    }
  }
  send_receipts();
  log_places_.tell_all();
}

void Daemon::run(int stop_descriptor) {
  StopDescriptor stop(stop_descriptor);
  run(stop);
}

/// Everything that happens at one moment; `is_due`: the world's next tick may be made.
void Daemon::tick(bool is_due) {
  PhaseTimer timer(times_, readings_.ticks);
  desk_.admit(inbox_.drain(), run_.world().tick() + 1, now_us());
  for (const std::string& name : desk_.take_newcomers()) {
    hello_log_.write(now_us(), {{"client", name}});
    described_ = {};
    next_description_us_ = 0;
  }
  for (const std::string& name : desk_.take_turned_away()) {
    full_log_.write(now_us(), {{"client", name}});
  }
  const bool is_stepping = is_due && time_.is_stepping(run_.world().tick());
  const bool has_changed = apply_due(is_stepping);
  if (is_stepping) step(timer);
  timer.publish();
  // A world that stands still is shown again with every heartbeat, for those who came later.
  const bool is_status_due = now_us() >= next_status_us_;
  if (is_stepping || has_changed || is_status_due) publish_states();
  answer_finished_steps();
  send_events();
  send_receipts();
  if (is_status_due) send_status();
}

/// What is told at its own times, however far the ticks are apart.
void Daemon::send_news() {
  send_events();
  if (now_us() < next_status_us_) return;
  publish_states();
  send_status();
}

bool Daemon::apply_due(bool is_stepping) {
  World& world = run_.world();
  const Tick coming = world.tick() + 1;
  const std::vector<Command> due = desk_.take_due(coming, is_stepping);
  journal_->append(coming, due);
  for (const Command& command : due) {
    const Outcome outcome = apply(command, world, time_, options_.permissions);
    const bool is_step = outcome.result == Result::queued;
    desk_.answer(command.header, outcome, is_step ? time_.pending.back().until : coming);
    for (Event& event : world.take_events()) {
      event.client = command.header.client;
      tell(std::move(event));
    }
  }
  return !due.empty();
}

void Daemon::tell(Event&& event) {
  const ShapeKind shape = event.shape.kind;
  if (event.kind == EventKind::spawned && !run_.world().can_collide(shape) &&
      not_colliding_told_.insert(shape).second) {
    not_colliding_log_.write(
        now_us(), {{"shape", word_of(shape)}, {"body", event.body.value}, {"name", event.name}});
  }
  events_.push_back(std::move(event));
}

void Daemon::step(PhaseTimer& timer) {
  const std::int64_t left_out = run_.wrenches_left_out();
  const bool was_crowded = last_report_.crowded > 0;
  const bool were_passing = last_report_.surfaces_passing > 0;
  last_report_ = run_.step(*executor_, &timer);
  readings_.steps_unsolved += last_report_.unsolved;
  readings_.islands_makeshift += last_report_.islands_makeshift;
  readings_.impacts += last_report_.impacts;
  readings_.impacts_ordered += last_report_.impacts_ordered;
  readings_.energy_paid_J += last_report_.paid_J;
  readings_.impacts_spent += last_report_.impacts_spent;
  readings_.stopped_at_impact += last_report_.stopped_at_impact;
  readings_.impacts_unresolved += last_report_.impacts_unresolved;
  readings_.spins_cut += last_report_.spins_cut;
  readings_.ticks_in_halves += last_report_.parts - 1;
  if (last_report_.springs_unconverged > 0) {
    readings_.springs_unconverged += last_report_.springs_unconverged;
    springs_log_.write(now_us(), {{"tick", run_.world().tick()}});
  }
  if (last_report_.crowded > 0 && !was_crowded) {
    crowd_log_.write(now_us(), {{"tick", run_.world().tick()}, {"bodies", last_report_.crowded}});
  }
  if (last_report_.surfaces_passing > 0 && !were_passing) {
    surfaces_log_.write(now_us(),
                        {{"tick", run_.world().tick()}, {"pairs", last_report_.surfaces_passing}});
  }
  if (run_.wrenches_left_out() > left_out) {
    left_out_log_.write(
        now_us(), {{"tick", run_.world().tick()}, {"count", run_.wrenches_left_out() - left_out}});
  }
  for (Event& event : run_.world().take_events()) {
    if (event.kind == EventKind::quarantined) {
      quarantine_log_.write(now_us(), {{"body", event.body.value},
                                       {"name", event.name},
                                       {"tick", event.tick},
                                       {"reason", to_string(event.reason)}});
    }
    tell(std::move(event));
  }
}

void Daemon::publish_states() {
  const World& world = run_.world();
  world.snapshot(snapshot_.states);
  snapshot_.epoch = epoch_;
  snapshot_.tick = world.tick();
  snapshot_.tick_time_us =
      static_cast<std::int64_t>(static_cast<double>(world.tick()) / world.settings().rate_hz * 1e6);
  snapshot_.sent_us = now_us();
  if (!time_.pending.empty()) publisher_.flush();  // steps asked for can wait, and none is skipped
  publisher_.publish(snapshot_);
}

/// A step command's answer follows its last tick's states.
void Daemon::answer_finished_steps() {
  auto& pending = time_.pending;
  while (!pending.empty() && pending.front().until <= run_.world().tick()) {
    publisher_.flush();
    desk_.answer(pending.front().header, {}, pending.front().until);
    pending.erase(pending.begin());
    if (pending.empty()) pacer_.restart(Pacer::Clock::now());  // these steps kept no pace
  }
}

void Daemon::send_receipts() {
  const std::vector<Receipt> all = desk_.take_receipts();
  const auto most =
      static_cast<std::size_t>(items_per_datagram(MessageKind::receipts, options_.datagram_bytes));
  for (std::size_t begin = 0; begin < all.size(); begin += most) {
    Receipts message{epoch_, {}};
    for (std::size_t i = begin; i < std::min(begin + most, all.size()); ++i) {
      message.receipts.push_back(all[i]);
    }
    control_->send(channels_.name(MessageKind::receipts), encode(message));
  }
}

void Daemon::send_events() {
  if (now_us() >= next_description_us_) {
    std::vector<Event> described = run_.world().describe(described_, kDescriptions);
    has_descriptions_ = !described.empty();
    next_description_us_ = now_us() + kDescriptionPeriod_us;
    for (Event& event : described) {
      described_ = event.body;
      events_.push_back(std::move(event));
    }
  }
  const auto most =
      static_cast<std::size_t>(items_per_datagram(MessageKind::events, options_.datagram_bytes));
  while (!events_.empty()) {
    Events message{epoch_, next_event_, {}};
    while (!events_.empty() && message.events.size() < most) {
      message.events.push_back(std::move(events_.front()));
      events_.pop_front();
    }
    next_event_ += static_cast<std::int64_t>(message.events.size());
    control_->send(channels_.name(MessageKind::events), encode(message));
  }
}

void Daemon::send_status() {
  note_rivals();
  next_status_us_ = now_us() + kStatusPeriod_us;
  const WorldStatus told = status();
  control_->send(channels_.name(MessageKind::status), encode(told));
  supervisor_->heartbeat(told);
  overruns_told_ = pacer_.overruns();
  times_ = {};
  log_places_.tell_due(now_us());
}

WorldStatus Daemon::status() {
  const World& world = run_.world();
  const TransportStats transport = control_->stats();
  const double ticks = static_cast<double>(std::max<std::int64_t>(times_.ticks, 1));
  WorldStatus s;
  s.protocol_version = kProtocolVersion;
  s.paused = time_.paused;
  s.lockstep = time_.lockstep;
  s.overloaded = pacer_.overruns() > overruns_told_;
  s.controllable = options_.permissions.control;
  s.contested = is_contested_;
  s.epoch = epoch_;
  s.tick = world.tick();
  s.rate_hz = world.settings().rate_hz;
  s.tick_time_us = static_cast<std::int64_t>(static_cast<double>(s.tick) / s.rate_hz * 1e6);
  s.real_time_factor = pacer_.real_time_factor(s.tick, Pacer::Clock::now());
  s.bodies = world.body_count();
  s.contacts = last_report_.contacts;
  s.clients = desk_.clients(now_us());
  s.wrenches = world.wrench_count();
  s.apply_us = times_.apply_us / ticks;
  s.collide_us = times_.collide_us / ticks;
  s.solve_us = times_.solve_us / ticks;
  s.publish_us = times_.publish_us / ticks;
  s.penetration_max_m = last_report_.penetration_max_m;
  s.penetration_mean_m = last_report_.penetration_mean_m;
  s.islands = last_report_.islands;
  s.sub_steps_max = last_report_.sub_steps_max;
  s.sag_expected_m = last_report_.sag_expected_m;
  s.residual_mps = last_report_.residual_mps;
  s.residual_relative = last_report_.residual_relative;
  s.residual_signorini_mps = last_report_.residual_signorini_mps;
  s.residual_cone_mps = last_report_.residual_cone_mps;
  s.residual_complementarity_J = last_report_.residual_complementarity_J;
  const StepBalance& balance = last_report_.balance;
  s.balance_tick = balance.tick;
  s.kinetic_change_J = balance.kinetic_J;
  s.work_gravity_J = balance.gravity_J;
  s.work_wrenches_J = balance.wrenches_J;
  s.work_friction_J = balance.friction_J;
  s.work_impacts_J = balance.impacts_J;
  s.work_driven_J = balance.driven_J;
  s.energy_unaccounted_J = balance.unaccounted_J;
  s.momentum_unaccounted_Ns = balance.momentum_unaccounted_Ns;
  s.impacts = last_report_.impacts;
  s.overruns = pacer_.overruns();
  s.commands_applied = desk_.applied();
  s.commands_refused = desk_.refused();
  const Inbox::Counters inbox = inbox_.counters();
  s.datagrams_rejected =
      transport.rejected() + inbox.rejected() + desk_.malformed() + unknown_datagrams_;
  s.datagrams_dropped = transport.dropped_by_kernel + inbox.dropped;
  s.chunks_dropped = publisher_.chunks_dropped() + states_->stats().send_failures;
  s.quarantined = world.quarantined_count();
  s.state_port = options_.state_port;
  s.datagram_bytes = options_.datagram_bytes;
  s.receive_buffer_bytes = transport.receive_buffer_bytes;
  s.name = options_.world;
  return s;
}

/// What the metrics page shows from now on.
void Daemon::put_readings() {
  const World& world = run_.world();
  Readings& r = readings_;
  r.world = options_.world;
  r.period_s = 1 / world.settings().rate_hz;
  r.tick = world.tick();
  r.overruns = pacer_.overruns();
  r.real_time_factor = pacer_.real_time_factor(r.tick, Pacer::Clock::now());
  r.bodies = world.body_count();
  r.awake = world.awake_count();
  r.contacts = last_report_.contacts;
  r.last_step = last_report_;
  r.wrenches = world.wrench_count();
  r.crowded = last_report_.crowded;
  r.surfaces_passing = last_report_.surfaces_passing;
  r.quarantines = world.quarantined_count();
  r.clients = desk_.clients(now_us());
  r.answers = desk_.answered();
  r.repeated_answers = desk_.repeated();
  r.control = control_->stats();
  r.states = states_->stats();
  r.inbox = inbox_.counters();
  r.unknown_channel = unknown_datagrams_;
  r.malformed = desk_.malformed();
  r.chunks_overtaken = publisher_.chunks_dropped();
  r.log_lines_left_out = log_places_.left_out();
  options_.board->put(r);
}

/// The receive thread: bytes into the inbox, nothing else.
void Daemon::receive(const std::atomic<bool>& is_ending) {
  while (!is_ending) {
    control_->receive(100ms, [this](std::string_view channel, ByteView payload) {
      const auto kind = channels_.kind(channel);
      if (!kind) {
        ++unknown_datagrams_;
      } else if (is_command(*kind)) {
        inbox_.put(*kind, payload);
      } else if (*kind == MessageKind::status && is_rival(payload)) {
        rival_heard_us_ = now_us();
      }  // else: what this daemon itself has sent
    });
  }
}

bool Daemon::is_rival(ByteView status_message) const {
  const auto heard = decode_status(status_message);
  return heard && heard->epoch != epoch_;
}

/// Two daemons of one world may meet when networks are joined. Neither gives way: clients see both
/// and send nothing, until somebody ends one.
void Daemon::note_rivals() {
  const bool is_contested =
      rival_heard_us_ != 0 && now_us() - rival_heard_us_ < 3 * kStatusPeriod_us;
  if (is_contested && !is_contested_) {
    rival_log_.write(now_us(), {{"world", options_.world}});
  } else if (!is_contested && is_contested_) {
    rival_gone_log_.write(now_us(), {{"world", options_.world}});
  }
  is_contested_ = is_contested;
}

/// When the next heartbeat or description is due.
Pacer::Clock::time_point Daemon::news_deadline() const {
  const std::int64_t due_us =
      has_descriptions_ ? std::min(next_status_us_, next_description_us_) : next_status_us_;
  return Pacer::Clock::time_point(std::chrono::microseconds(due_us));
}

/// Sleeps until something is to be done. A world that runs, or is paused, wakes at its rate; one in
/// lockstep when a command comes; steps asked for are made at once.
Daemon::Awoken Daemon::wait() {
  const bool has_steps = !time_.pending.empty();
  const bool is_waiting_for_commands = time_.lockstep && !has_steps;
  const auto begin = Pacer::Clock::now();
  auto tick_deadline = has_steps ? begin : pacer_.deadline();
  if (is_waiting_for_commands) tick_deadline = Pacer::Clock::time_point::max();
  const auto deadline = std::min(tick_deadline, news_deadline());

  pollfd descriptors[] = {{supervisor_->descriptor(), POLLIN, 0},
                          {inbox_.file_descriptor(), POLLIN, 0}};
  const auto left = std::max(deadline - begin, Pacer::Clock::duration::zero());
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(left);
  const timespec timeout{seconds.count(), std::chrono::nanoseconds(left - seconds).count()};
  ::ppoll(descriptors, is_waiting_for_commands ? 2 : 1, &timeout, nullptr);

  if (descriptors[0].revents != 0) return Awoken::supervisor;
  if (is_waiting_for_commands && descriptors[1].revents != 0) return Awoken::command;
  const auto now = Pacer::Clock::now();
  if (now < tick_deadline) return Awoken::news;
  if (!has_steps) pacer_.begin_tick(now);
  return Awoken::tick;
}

}  // namespace cradle
