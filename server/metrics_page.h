/// Serves one page over HTTP, `/metrics`, on loopback, to Prometheus and to people with curl.
///
/// A thread of its own; who steps the world never waits for who reads, nor does one reader for
/// another: nothing blocks, a reader that does nothing is shut out after five seconds, and the one
/// that came first makes room for the seventeenth. Only GET and HEAD; nothing that is sent here
/// changes anything.
///
/// Why not the server of prometheus-cpp 1.0.1: as many silent connections as it has threads keep
/// everybody else out (more than 20 s, measured), and it brings a whole web server along.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>

namespace cradle {

/// `127.0.0.1:9464` or `[::1]:9464`.
struct PageAddress {
  std::string host;
  int port = 0;
};
/// Nothing if `text` is no numeric address with a port of 1 to 65535, or not one of loopback.
std::optional<PageAddress> parse_page_address(std::string_view text);

/// The port cannot be opened: one line.
class PageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class MetricsPage {
 public:
  /// `text` makes the page, in the thread of this object. Throws PageError.
  MetricsPage(const PageAddress& address, std::function<std::string()> text);
  ~MetricsPage();
  MetricsPage(const MetricsPage&) = delete;
  MetricsPage& operator=(const MetricsPage&) = delete;

 private:
  void run();

  std::function<std::string()> text_;
  int listener_ = -1;
  int ending_ = -1;  ///< readable when the thread shall end
  std::thread thread_;
};

}  // namespace cradle
