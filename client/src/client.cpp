#include <cradle/client.h>
#include <poll.h>

#include <thread>
#include <utility>

#include "client/src/client_impl.h"

namespace cradle {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

/// Shorter than the first pause before a command is sent again.
constexpr milliseconds kLongestSleep{10};

/// Returns when either port may have something, or after `timeout`.
void wait_for_input(const ClientCore& core, milliseconds timeout) {
  const int control = core.control().file_descriptor();
  const int states = core.states() ? core.states()->file_descriptor() : -1;
  if (control < 0) {
    std::this_thread::sleep_for(std::min(timeout, milliseconds(1)));  // not a network: look again
    return;
  }
  pollfd ports[] = {{control, POLLIN, 0}, {states, POLLIN, 0}};  // ::poll ignores a negative one
  ::poll(ports, 2, static_cast<int>(timeout.count()));
}

template <class T>
std::vector<T> list(std::span<const T> items) {
  return {items.begin(), items.end()};
}

}  // namespace

Ticket Client::Impl::submit(CommandBody body, Tick target_tick) {
  return core.submit(std::move(body), target_tick, recording ? recording->time() : Clock::now());
}

int Client::Impl::poll_once() {
  return core.poll(recording ? recording->play(Clock::now()) : Clock::now());
}

int Client::Impl::poll(milliseconds wait) {
  const auto deadline = Clock::now() + wait;
  int messages = poll_once();
  while (messages == 0 && !core.is_in_callback()) {
    const auto left = std::chrono::ceil<milliseconds>(deadline - Clock::now());
    if (left <= milliseconds(0)) break;
    if (recording) {
      std::this_thread::sleep_for(
          std::min<std::chrono::microseconds>(left, recording->until_next(Clock::now())));
    } else {
      wait_for_input(core, std::min(left, kLongestSleep));
    }
    messages = poll_once();
  }
  return messages;
}

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::~Client() = default;

Ticket Client::spawn(const BodySpec& spec, When when) { return spawn(std::span(&spec, 1), when); }
Ticket Client::spawn(std::span<const BodySpec> specs, When when) {
  return impl_->submit(Spawn{list(specs)}, when.tick);
}
Ticket Client::despawn(BodyId body, When when) { return despawn(std::span(&body, 1), when); }
Ticket Client::despawn(std::span<const BodyId> bodies, When when) {
  return impl_->submit(Despawn{list(bodies)}, when.tick);
}
Ticket Client::push(const Wrench& wrench, When when) { return push(std::span(&wrench, 1), when); }
Ticket Client::push(std::span<const Wrench> wrenches, When when) {
  return impl_->submit(Push{list(wrenches)}, when.tick);
}
Ticket Client::clear_wrenches(BodyId body, When when) {
  return clear_wrenches(std::span(&body, 1), when);
}
Ticket Client::clear_wrenches(std::span<const BodyId> bodies, When when) {
  return impl_->submit(ClearWrenches{list(bodies)}, when.tick);
}
Ticket Client::set_motion(const Motion& motion, When when) {
  return set_motion(std::span(&motion, 1), when);
}
Ticket Client::set_motion(std::span<const Motion> motions, When when) {
  return impl_->submit(SetMotion{list(motions)}, when.tick);
}
Ticket Client::set_gravity(const Vec3& gravity_W, When when) {
  return impl_->submit(SetGravity{gravity_W}, when.tick);
}
Ticket Client::pause(When when) {
  return impl_->submit(Control{ControlAction::pause, 0}, when.tick);
}
Ticket Client::resume(When when) {
  return impl_->submit(Control{ControlAction::resume, 0}, when.tick);
}
Ticket Client::step(std::int64_t ticks, When when) {
  return impl_->submit(Control{ControlAction::step, ticks}, when.tick);
}
Ticket Client::shutdown() { return impl_->submit(Control{ControlAction::shutdown, 0}, 0); }
BatchLimits Client::batch_limits() const { return impl_->core.batch_limits(); }

std::optional<Answer> Client::answer(Ticket ticket) const { return impl_->core.answer(ticket); }

Answer Client::wait(Ticket ticket, milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  auto known = answer(ticket);
  while (!known && !impl_->core.is_in_callback()) {
    const auto left = std::chrono::ceil<milliseconds>(deadline - Clock::now());
    if (left <= milliseconds(0)) break;
    poll(left);
    known = answer(ticket);
  }
  return known.value_or(Answer{Result::timed_out, {}, 0, 0});
}

int Client::poll(milliseconds wait) { return impl_->poll(wait); }

std::span<const BodyView> Client::bodies() const { return impl_->core.mirror().bodies(); }
const BodyView* Client::find(BodyId body) const { return impl_->core.mirror().find(body); }
const Event* Client::about(BodyId body) const { return impl_->core.mirror().about(body); }
std::string_view Client::name(BodyId body) const {
  const Event* known = about(body);
  return known ? std::string_view(known->name) : std::string_view();
}
BodyId Client::find_by_name(std::string_view name) const {
  return impl_->core.mirror().find_by_name(name);
}

Tick Client::tick() const { return impl_->core.tick(); }
double Client::time_s() const {
  const auto& core = impl_->core;
  return 1e-6 *
         static_cast<double>(std::max(core.mirror().tick_time_us(), core.status().tick_time_us));
}
double Client::age_s(const BodyView& view) const {
  const double rate_hz = status().rate_hz;
  return rate_hz > 0 ? static_cast<double>(tick() - view.tick) / rate_hz : 0;
}
double Client::wall_age_s(const BodyView& view) const {
  return std::chrono::duration<double>(impl_->core.polled_at() - view.received_at).count();
}

const WorldStatus& Client::status() const { return impl_->core.status(); }
std::int64_t Client::epoch() const { return impl_->core.epoch(); }
bool Client::is_alive() const { return impl_->core.is_alive() && !has_ended(); }
bool Client::is_contested() const { return impl_->core.is_contested(); }
bool Client::is_recording() const { return impl_->recording != nullptr; }
bool Client::has_ended() const { return is_recording() && impl_->recording->has_ended(); }

void Client::on_event(std::function<void(const Event&)> callback) {
  impl_->core.callbacks.on_event = std::move(callback);
}
void Client::on_answer(std::function<void(Ticket, const Answer&)> callback) {
  impl_->core.callbacks.on_answer = std::move(callback);
}
void Client::on_tick(std::function<void(Tick)> callback) {
  impl_->core.callbacks.on_tick = std::move(callback);
}
void Client::on_restart(std::function<void(std::int64_t epoch)> callback) {
  impl_->core.callbacks.on_restart = std::move(callback);
}

const std::string& Client::last_callback_error() const { return impl_->core.last_callback_error(); }
ClientStatistics Client::statistics() const { return impl_->core.statistics(); }

}  // namespace cradle
