#include "session.h"

#include <charconv>
#include <cstdio>
#include <optional>

namespace cradle::tool {
namespace {

using Clock = std::chrono::steady_clock;

std::optional<BodyId> as_id(const std::string& text) {
  BodyId id;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id.value);
  const bool is_number = error == std::errc{} && end == text.data() + text.size();
  return is_number ? std::optional(id) : std::nullopt;
}

/// The server tells the names of older bodies after hello, some in each tick.
BodyId find_name(Session& session, const std::string& name) {
  const auto deadline = Clock::now() + session.timeout;
  BodyId found = session.client.find_by_name(name);
  while (!found && Clock::now() < deadline) {
    session.client.poll(std::chrono::milliseconds(10));
    found = session.client.find_by_name(name);
  }
  return found;
}

}  // namespace

void complain(const std::string& line) { std::fprintf(stderr, "cradle: %s\n", line.c_str()); }

int finish(Session& session, Ticket ticket) {
  const Answer answer = session.client.wait(ticket, session.timeout);
  if (answer) {
    std::printf("tick %lld\n", static_cast<long long>(answer.tick));
    return kExitOk;
  }
  if (answer.result == Result::timed_out || answer.result == Result::world_restarted) {
    complain("no answer: " + std::string(to_string(answer.result)));
    return kExitUnavailable;
  }
  complain("refused: " + std::string(to_string(answer.result)));
  return kExitRefused;
}

std::vector<BodyId> find_bodies(Session& session, const std::vector<std::string>& texts) {
  std::vector<BodyId> bodies;
  for (const std::string& text : texts) {
    const auto id = as_id(text);
    bodies.push_back(id ? *id : find_name(session, text));
    if (!id && !bodies.back()) {
      complain("no body is called '" + text + "'");
      return {};
    }
  }
  return bodies;
}

}  // namespace cradle::tool
