/// Finding a world, and saying in one line why it could not be found.
#include <cradle/limits.h>
#include <cradle/version.h>

#include <cstdlib>
#include <system_error>

#include "client/src/client_impl.h"
#include "protocol/transport/lcm_transport.h"
#include "protocol/transport/lcm_url.h"
#include "protocol/validate.h"

namespace cradle {
namespace {

using Clock = std::chrono::steady_clock;
using Welcome = ClientCore::Welcome;

std::string quoted(std::string_view text) { return "'" + std::string(text) + "'"; }

/// What is wrong with the options, if anything.
Connection check(const ClientOptions& options) {
  const bool is_recording = is_recording_url(options.lcm_url);
  if (is_recording ? !parse_recording_url(options.lcm_url) : !parse_lcm_url(options.lcm_url)) {
    return {nullptr, Result::bad_url,
            quoted(options.lcm_url) + " is not like " +
                (is_recording ? "file://PATH?speed=1&states=PATH"
                              : "udpm://239.255.76.67:7667?ttl=0, nor file://PATH")};
  }
  if (!is_world_name(options.world)) {
    return {nullptr, Result::bad_name,
            "the name of a world has 1 to " + std::to_string(limits::kWorldNameBytes) +
                " letters, digits, '-' and '_', unlike " + quoted(options.world)};
  }
  if (!is_name(options.name, limits::kNameBytes)) {
    return {nullptr, Result::bad_name,
            "the name of a client has at most " + std::to_string(limits::kNameBytes) +
                " bytes of UTF-8 without control characters"};
  }
  if (options.number < 0 || options.number > limits::kIntegerMax) {
    return {nullptr, Result::out_of_range,
            "the number of a client is at most " + std::to_string(limits::kIntegerMax)};
  }
  return {};
}

/// Opens states on the same group, at the port the world names.
ClientCore::OpenStates states_opener(const LcmUrl& url) {
  return [url](int port) -> OpenedTransport {
    constexpr int kPortMin = 1024, kPortMax = 65535;
    if (port < kPortMin || port > kPortMax) {
      return {nullptr, Result::no_network,
              "the world names port " + std::to_string(port) + " for its states"};
    }
    return open_lcm_transport({url.group, port, url.ttl}, Lane::send_and_receive);
  };
}

std::string hello_fault(Result result) {
  if (result == Result::over_quota) return "takes no more clients";
  if (result == Result::bad_version) return "speaks another protocol version than ours";
  if (result == Result::superseded) {
    return "knows a later client of our number: the clock was set back, or it lives elsewhere";
  }
  return "refuses us: " + std::string(to_string(result));
}

std::string heard_instead(const std::set<std::string>& worlds) {
  std::string text;
  for (const std::string& world : worlds)
    text += (text.empty() ? "; heard instead: " : ", ") + world;
  return text;
}

/// Why we are not welcome after all the time there was.
Connection fault(const ClientCore& core, const std::string& name, const std::string& place) {
  const std::string world = "world " + quoted(name);
  if (!core.states_fault().empty()) return {nullptr, Result::no_network, core.states_fault()};
  if (core.welcome() == Welcome::unseen && core.has_heard_other_protocol()) {
    return {nullptr, Result::bad_version,
            world + " speaks another protocol version than ours, which is " +
                std::to_string(kProtocolVersion)};
  }
  if (core.welcome() == Welcome::unseen) {
    std::string heard = heard_instead(core.other_worlds());
    if (heard.empty()) heard = "; start it: cradled serve --world " + name;
    return {nullptr, Result::no_world, "no heartbeat of " + world + " on " + place + heard};
  }
  if (core.welcome() == Welcome::forgotten) {
    return {nullptr, core.hello_result(), world + " " + hello_fault(core.hello_result())};
  }
  return {nullptr, Result::timed_out, world + " has a heartbeat, but does not answer"};
}

/// True if waiting longer changes nothing.
bool is_settled(const ClientCore& core) {
  return core.welcome() == Welcome::given || core.welcome() == Welcome::forgotten ||
         !core.states_fault().empty() ||
         (core.welcome() == Welcome::unseen && core.has_heard_other_protocol());
}

/// With a number of its own, a client that is started again is the same one to the world: its
/// sequence begins with the time, in units of which no run sends more than one command.
ClientCore::Identity identity_of(const ClientOptions& options) {
  if (options.number == 0) return {0, 1, options.is_spectator};
  using namespace std::chrono;
  constexpr std::int64_t kUnitsPerSecond = 1 << 22;
  constexpr sys_days kBegin = 2024y / 1 / 1;  // 68 years fit into limits::kIntegerMax
  const auto since = duration_cast<milliseconds>(system_clock::now() - kBegin).count();
  return {options.number, 1 + since * (kUnitsPerSecond / 1000), options.is_spectator};
}

}  // namespace

ClientOptions ClientOptions::from_environment(std::string name) {
  ClientOptions options;
  options.name = std::move(name);
  if (const char* url = std::getenv("CRADLE_LCM_URL")) options.lcm_url = url;
  if (const char* world = std::getenv("CRADLE_WORLD")) options.world = world;
  return options;
}

Connection introduce(std::unique_ptr<Client::Impl> impl, const std::string& world,
                     const std::string& place, std::chrono::milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  while (!is_settled(impl->core) && Clock::now() < deadline) {
    impl->poll(std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()));
  }
  const bool is_welcome = impl->core.welcome() == Welcome::given && impl->core.states();
  if (!is_welcome) return fault(impl->core, world, place);
  return {std::make_unique<Client>(std::move(impl)), Result::ok, ""};
}

std::string recording_url(const std::string& path, const std::string& states_path, double speed) {
  return RecordingUrl{path, states_path, speed}.text();
}

Connection connect_to_recording(const ClientOptions& options, std::chrono::milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  std::unique_ptr<Recording> file;
  try {
    file = std::make_unique<Recording>(*parse_recording_url(options.lcm_url), options.world,
                                       Clock::now());
  } catch (const std::system_error& error) {
    return {nullptr, Result::bad_recording, error.what()};
  }
  auto impl = std::make_unique<Client::Impl>(options.world, std::move(file));
  const Recording& recording = *impl->recording;
  while (impl->core.epoch() == 0 && !recording.has_ended() && Clock::now() < deadline) {
    impl->core.poll(impl->recording->play(Clock::now()));
  }
  const std::string place = parse_recording_url(options.lcm_url)->path;
  if (impl->core.has_heard_other_protocol()) return fault(impl->core, options.world, place);
  if (impl->core.epoch() != 0) return {std::make_unique<Client>(std::move(impl)), Result::ok, ""};
  if (recording.messages_read() == 0) {
    return {nullptr, Result::bad_recording, place + " is no recording of lcm-logger"};
  }
  return {nullptr, Result::no_world,
          "nothing of world " + quoted(options.world) + " in " + place +
              heard_instead(recording.other_worlds())};
}

Connection Client::connect(const ClientOptions& options, std::chrono::milliseconds timeout) {
  if (Connection bad = check(options); bad.result != Result::ok) return bad;
  if (is_recording_url(options.lcm_url)) return connect_to_recording(options, timeout);
  const LcmUrl url = *parse_lcm_url(options.lcm_url);
  OpenedTransport control = open_lcm_transport(url, Lane::send_and_receive);
  if (!control.transport) return {nullptr, control.result, control.message};

  return introduce(std::make_unique<Impl>(options.world, options.name, std::move(control.transport),
                                          states_opener(url), identity_of(options)),
                   options.world, url.text(), timeout);
}

}  // namespace cradle
