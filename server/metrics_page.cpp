#include "server/metrics_page.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <list>
#include <vector>

namespace cradle {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr std::size_t kConnections = 16;
constexpr std::size_t kRequestBytes = 8192;  // what Prometheus sends has 300
constexpr auto kPatience = 5s;               // for a whole connection
constexpr std::string_view kTextType = "text/plain; version=0.0.4; charset=utf-8";

/// The address as the kernel wants it.
struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t size = 0;
  const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&storage); }
};

std::optional<SocketAddress> socket_address(const PageAddress& address) {
  SocketAddress result;
  sockaddr_in v4{};
  sockaddr_in6 v6{};
  const auto port = htons(static_cast<std::uint16_t>(address.port));
  if (::inet_pton(AF_INET, address.host.c_str(), &v4.sin_addr) == 1) {
    if (ntohl(v4.sin_addr.s_addr) >> 24 != 127) return std::nullopt;
    v4.sin_family = AF_INET;
    v4.sin_port = port;
    std::memcpy(&result.storage, &v4, result.size = sizeof v4);
  } else if (::inet_pton(AF_INET6, address.host.c_str(), &v6.sin6_addr) == 1) {
    if (!IN6_IS_ADDR_LOOPBACK(&v6.sin6_addr)) return std::nullopt;
    v6.sin6_family = AF_INET6;
    v6.sin6_port = port;
    std::memcpy(&result.storage, &v6, result.size = sizeof v6);
  } else {
    return std::nullopt;
  }
  return result;
}

std::string response(std::string_view status, std::string_view type, const std::string& body,
                     bool has_body) {
  std::string text = "HTTP/1.1 " + std::string(status) + "\r\nContent-Type: " + std::string(type) +
                     "\r\nContent-Length: " + std::to_string(body.size()) +
                     "\r\nConnection: close\r\n";
  if (status.starts_with("405")) text += "Allow: GET, HEAD\r\n";
  text += "\r\n";
  if (has_body) text += body;
  return text;
}

/// The answer to a request whose head is complete.
std::string answer(std::string_view request, const std::function<std::string()>& page) {
  const auto refuse = [](const char* status) {
    return response(status, "text/plain", std::string(status) + "\n", true);
  };
  const std::string_view line = request.substr(0, request.find("\r\n"));
  const std::size_t method_end = line.find(' ');
  const std::size_t target_end = line.rfind(' ');
  if (method_end == std::string_view::npos || target_end == method_end ||
      !line.substr(target_end + 1).starts_with("HTTP/1.")) {
    return refuse("400 Bad Request");
  }
  const std::string_view method = line.substr(0, method_end);
  const std::string_view target = line.substr(method_end + 1, target_end - method_end - 1);
  if (method != "GET" && method != "HEAD") return refuse("405 Method Not Allowed");
  if (target.substr(0, target.find('?')) != "/metrics") return refuse("404 Not Found");
  return response("200 OK", kTextType, page(), method == "GET");
}

/// One reader: its request comes, its answer goes.
class Connection {
 public:
  explicit Connection(int socket) : socket_(socket) {}
  ~Connection() { ::close(socket_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  pollfd wanted() const {
    return {socket_, static_cast<short>(is_answered_ ? POLLOUT : POLLIN), 0};
  }
  Clock::time_point deadline() const { return deadline_; }

  /// Goes on as far as it can; false when all is done, or nothing more can be.
  bool go_on(const std::function<std::string()>& page) {
    if (!is_answered_ && !read(page)) return false;
    return !is_answered_ || write();
  }

 private:
  bool read(const std::function<std::string()>& page) {
    char bytes[2048];
    const ssize_t count = ::recv(socket_, bytes, sizeof bytes, MSG_DONTWAIT);
    if (count < 0) return errno == EAGAIN || errno == EINTR;
    if (count == 0) return false;
    request_.append(bytes, static_cast<std::size_t>(count));
    if (request_.find("\r\n\r\n") != std::string::npos) {
      answer_ = answer(request_, page);
      is_answered_ = true;
    }
    return request_.size() <= kRequestBytes;
  }

  bool write() {
    const ssize_t count = ::send(socket_, answer_.data() + sent_, answer_.size() - sent_,
                                 MSG_DONTWAIT | MSG_NOSIGNAL);
    if (count < 0) return errno == EAGAIN || errno == EINTR;
    sent_ += static_cast<std::size_t>(count);
    return sent_ < answer_.size();
  }

  int socket_;
  Clock::time_point deadline_ = Clock::now() + kPatience;
  std::string request_;
  bool is_answered_ = false;
  std::string answer_;
  std::size_t sent_ = 0;
};

int open_listener(const PageAddress& address) {
  const auto fail = [&](int socket) -> PageError {
    const std::string reason = std::strerror(errno);
    if (socket >= 0) ::close(socket);
    return PageError("metrics on " + address.host + " port " + std::to_string(address.port) + ": " +
                     reason);
  };
  const auto bound = socket_address(address);
  if (!bound) throw PageError("metrics: " + address.host + " is not an address of loopback");
  const int socket =
      ::socket(bound->storage.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const int yes = 1;  // a port whose last connections are still being forgotten is free
  if (socket < 0 || ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) < 0 ||
      ::bind(socket, bound->get(), bound->size) < 0 || ::listen(socket, kConnections) < 0) {
    throw fail(socket);
  }
  return socket;
}

}  // namespace

std::optional<PageAddress> parse_page_address(std::string_view text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) return std::nullopt;
  PageAddress address{std::string(text.substr(0, colon)), 0};
  const bool has_brackets = address.host.starts_with('[') && address.host.ends_with(']');
  if (has_brackets) address.host = address.host.substr(1, address.host.size() - 2);
  if (has_brackets != (address.host.find(':') != std::string::npos)) return std::nullopt;
  const std::string_view port = text.substr(colon + 1);
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), address.port);
  const bool is_port = error == std::errc() && end == port.data() + port.size() &&
                       address.port >= 1 && address.port <= 65535;
  return is_port && socket_address(address) ? std::optional(address) : std::nullopt;
}

MetricsPage::MetricsPage(const PageAddress& address, std::function<std::string()> text)
    : text_(std::move(text)),
      listener_(open_listener(address)),
      ending_(::eventfd(0, EFD_CLOEXEC)) {
  thread_ = std::thread([this] { run(); });
}

MetricsPage::~MetricsPage() {
  ::eventfd_write(ending_, 1);
  thread_.join();
  ::close(ending_);
  ::close(listener_);
}

void MetricsPage::run() {
  std::list<Connection> connections;  // in the order in which they came
  while (true) {
    std::vector<pollfd> waiting = {{ending_, POLLIN, 0}, {listener_, POLLIN, 0}};
    for (const Connection& connection : connections) waiting.push_back(connection.wanted());
    ::poll(waiting.data(), waiting.size(), connections.empty() ? -1 : 200);
    if (waiting[0].revents != 0) return;

    const auto now = Clock::now();
    auto polled = waiting.begin() + 2;
    for (auto connection = connections.begin(); connection != connections.end();) {
      const bool can_go_on = (polled++)->revents != 0;
      const bool is_over =
          now >= connection->deadline() || (can_go_on && !connection->go_on(text_));
      connection = is_over ? connections.erase(connection) : std::next(connection);
    }
    if (waiting[1].revents == 0) continue;
    const int socket = ::accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (socket < 0) {
      std::this_thread::sleep_for(10ms);  // out of descriptors: do not spin
      continue;
    }
    if (connections.size() >= kConnections) connections.pop_front();
    connections.emplace_back(socket);
  }
}

}  // namespace cradle
