#include "protocol/transport/lcm_url.h"

#include <arpa/inet.h>
#include <cradle/limits.h>

#include <charconv>

namespace cradle {
namespace {

std::optional<int> number(std::string_view text, int lowest, int highest) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value >= lowest && value <= highest ? std::optional(value) : std::nullopt;
}

bool is_multicast(const std::string& group) {
  in_addr address{};
  return inet_pton(AF_INET, group.c_str(), &address) == 1 && IN_MULTICAST(ntohl(address.s_addr));
}

/// Cuts `text` at the first `mark`; what follows it, or nothing.
std::optional<std::string_view> cut(std::string_view& text, char mark) {
  const auto at = text.find(mark);
  if (at == std::string_view::npos) return std::nullopt;
  const auto rest = text.substr(at + 1);
  text = text.substr(0, at);
  return rest;
}

}  // namespace

std::string LcmUrl::text() const {
  return "udpm://" + group + ":" + std::to_string(port) + "?ttl=" + std::to_string(ttl);
}

std::optional<LcmUrl> parse_lcm_url(std::string_view text) {
  LcmUrl url;
  if (text.empty()) return url;
  constexpr std::string_view kScheme = "udpm://";
  if (!text.starts_with(kScheme)) return std::nullopt;
  text.remove_prefix(kScheme.size());
  if (const auto option = cut(text, '?')) {
    if (!option->starts_with("ttl=")) return std::nullopt;
    const auto ttl = number(option->substr(4), 0, 255);
    if (!ttl) return std::nullopt;
    url.ttl = *ttl;
  }
  if (const auto port_text = cut(text, ':')) {
    const auto port = number(*port_text, 1024, 65534);  // one more for the states
    if (!port) return std::nullopt;
    url.port = *port;
  }
  if (!text.empty()) url.group = text;
  if (!is_multicast(url.group)) return std::nullopt;
  return url;
}

int default_datagram_bytes(const LcmUrl& url) {
  return url.ttl == 0 ? limits::kLoopbackDatagramBytes : limits::kNetworkDatagramBytes;
}

}  // namespace cradle
