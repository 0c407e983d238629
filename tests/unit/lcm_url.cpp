// Where a world is on the network, as text.
#include "protocol/transport/lcm_url.h"

#include <catch2/catch.hpp>

namespace cradle {
namespace {

bool means(std::string_view text, const LcmUrl& expected) {
  const auto url = parse_lcm_url(text);
  return url && url->group == expected.group && url->port == expected.port &&
         url->ttl == expected.ttl;
}

}  // namespace

TEST_CASE("a URL names group, port and ttl, what it leaves out is LCM's default, on this host") {
  const LcmUrl usual{"239.255.76.67", 7667, 0};  // LCM's default group and port
  CHECK(means("", usual));
  CHECK(means("udpm://", usual));
  CHECK(means("udpm://239.255.76.67:7667?ttl=0", usual));
  CHECK(means("udpm://:8000", {usual.group, 8000, 0}));
  CHECK(means("udpm://224.1.2.3", {"224.1.2.3", 7667, 0}));
  CHECK(means("udpm://224.1.2.3?ttl=255", {"224.1.2.3", 7667, 255}));
  CHECK(means("udpm://224.0.0.0:1024?ttl=1", {"224.0.0.0", 1024, 1}));
  CHECK(means("udpm://239.255.255.255:65534", {"239.255.255.255", 65534, 0}));
}

TEST_CASE("a URL with anything else is refused") {
  for (const char* bad : {"udp://239.255.76.67:7667",
                          "UDPM://239.255.76.67:7667",
                          "239.255.76.67:7667",
                          "memq://",
                          "udpm:/239.255.76.67",
                          "udpm://223.255.255.255",
                          "udpm://240.0.0.0",
                          "udpm://127.0.0.1",
                          "udpm://localhost",
                          "udpm://239.255.76",
                          "udpm://239.255.76.256",
                          "udpm://[ff02::1]:7667",
                          "udpm://239.255.76.67:",
                          "udpm://239.255.76.67:1023",
                          "udpm://239.255.76.67:65535",
                          "udpm://239.255.76.67:99999999999",
                          "udpm://239.255.76.67:76x7",
                          "udpm://:7667/",
                          "udpm://:7667?",
                          "udpm://:7667?ttl=",
                          "udpm://:7667?ttl=-1",
                          "udpm://:7667?ttl=256",
                          "udpm://:7667?ttl=1&ttl=2",
                          "udpm://:7667?tll=1",
                          "udpm://:7667?recv_buf_size=1",
                          " udpm://:7667",
                          "udpm://:7667 "}) {
    CAPTURE(bad);
    CHECK(!parse_lcm_url(bad));
  }
}

TEST_CASE("a URL's text means the same again, and its states are one port higher") {
  const LcmUrl url{"239.1.2.3", 9000, 7};
  CHECK(url.text() == "udpm://239.1.2.3:9000?ttl=7");
  CHECK(means(url.text(), url));
  CHECK(means(url.state_lane().text(), {"239.1.2.3", 9001, 7}));
}

}  // namespace cradle
