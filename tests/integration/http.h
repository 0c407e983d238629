/// A reader of the metrics page.
#pragma once

#include <string>

#include "tests/integration/process.h"

namespace cradle {

/// A connection to a port of 127.0.0.1, with all the patience that a test needs.
class TcpConnection {
 public:
  explicit TcpConnection(int port);
  ~TcpConnection();
  TcpConnection(const TcpConnection&) = delete;
  TcpConnection& operator=(const TcpConnection&) = delete;

  bool is_open() const { return socket_ >= 0; }
  void send(const std::string& text) const;
  /// Until the other side closes.
  std::string read_all() const;

 private:
  int socket_ = -1;
};

/// A TCP port that no other test that runs now has.
int own_tcp_port();

/// The whole answer to a request; empty if nobody listens.
std::string http(int port, const std::string& request);
/// The body of `GET /metrics`.
std::string scrape(int port);

}  // namespace cradle
