#include "tests/integration/http.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include "protocol/transport/lcm_url.h"

namespace cradle {

TcpConnection::TcpConnection(int port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const timeval patience{60, 0};
  ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    ::close(socket_);
    socket_ = -1;
  }
}

TcpConnection::~TcpConnection() {
  if (is_open()) ::close(socket_);
}

void TcpConnection::send(const std::string& text) const {
  ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL);
}

std::string TcpConnection::read_all() const {
  std::string all;
  char bytes[4096];
  for (ssize_t count; (count = ::recv(socket_, bytes, sizeof bytes, 0)) > 0;) {
    all.append(bytes, static_cast<std::size_t>(count));
  }
  return all;
}

int own_tcp_port() { return parse_lcm_url(own_url())->port; }

std::string http(int port, const std::string& request) {
  const TcpConnection connection(port);
  if (!connection.is_open()) return {};
  connection.send(request);
  return connection.read_all();
}

std::string scrape(int port) {
  const std::string answer = http(port, "GET /metrics HTTP/1.1\r\nHost: cradled\r\n\r\n");
  const std::size_t head = answer.find("\r\n\r\n");
  return head == std::string::npos ? "" : answer.substr(head + 4);
}

}  // namespace cradle
