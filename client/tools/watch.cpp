#include "watch.h"

#include <langinfo.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <clocale>
#include <cstdlib>
#include <string_view>

#include "table.h"

namespace cradle::tool {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kFrame = 100ms;    // on a terminal
constexpr auto kPlainFrame = 1s;  // in a file or a pipe
constexpr int kPlainRows = 24;
constexpr std::size_t kNews = 3;  // events shown

volatile sig_atomic_t is_interrupted = 0;

void stop_on_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { is_interrupted = 1; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

Style terminal_style() {
  std::setlocale(LC_CTYPE, "");
  Style style;
  style.has_utf8 = std::string_view(nl_langinfo(CODESET)) == "UTF-8";
  style.rows = kPlainRows;
  winsize size{};
  if (::isatty(STDOUT_FILENO) != 0 && ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0) {
    style.has_colour = std::getenv("NO_COLOR") == nullptr;
    if (size.ws_col > 0) style.columns = size.ws_col;
    if (size.ws_row > 0) style.rows = size.ws_row;
  }
  return style;
}

/// Draws over its last picture, without cursor and without wrapping; sets both right at the end.
class Screen {
 public:
  Screen() { std::fputs("\x1b[?25l\x1b[?7l", stdout); }
  ~Screen() {
    std::fputs("\x1b[?25h\x1b[?7h", stdout);
    std::fflush(stdout);
  }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  void show(const std::vector<std::string>& lines) {
    std::string picture = "\r";
    if (height_ > 0) picture += format("\x1b[%zuA", height_);
    for (const std::string& line : lines) picture += line + "\x1b[K\n";
    picture += "\x1b[J";
    std::fputs(picture.c_str(), stdout);
    std::fflush(stdout);
    height_ = lines.size();
  }

 private:
  std::size_t height_ = 0;
};

void print(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) std::printf("%s\n", line.c_str());
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace

int watch(Session& session, std::chrono::duration<double> duration) {
  Client& client = session.client;
  stop_on_signals();
  std::deque<Event> news;
  client.on_event([&news](const Event& event) {
    const bool is_news = event.kind <= EventKind::quarantined;  // who sleeps, the table shows
    if (!is_news) return;
    news.push_back(event);
    if (news.size() > kNews) news.pop_front();
  });

  const bool is_terminal = ::isatty(STDOUT_FILENO) != 0;
  std::optional<Screen> screen;
  if (is_terminal) screen.emplace();
  const auto begin = Clock::now();
  auto next_frame = begin + kFrame;  // something has come by then
  while (is_interrupted == 0 && Clock::now() - begin < duration) {
    client.poll(10ms);
    const bool is_last = client.has_ended();
    if (Clock::now() < next_frame && !is_last) continue;
    next_frame += is_terminal ? kFrame : kPlainFrame;
    const auto lines = draw(client, news, terminal_style());
    screen ? screen->show(lines) : print(lines);
    if (is_last) break;
  }
  return kExitOk;
}

}  // namespace cradle::tool
