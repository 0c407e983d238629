#include "table.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace cradle::tool {
namespace {

constexpr double kMoving_mps = 0.02;  // slower looks at rest at two decimals
constexpr double kMoving_radps = 0.05;
constexpr double kFullBar_mps = 10;
constexpr int kBarCells = 10;
constexpr int kColumnsWithBar = 90;
constexpr int kNameColumns = 14;

double norm(const Vec3& v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }

/// Without the sign of what is printed as zero.
double tidy(double x) { return std::abs(x) < 0.005 ? 0 : x; }

bool is_moving(const BodyState& s) {
  return norm(s.v_WBcm) > kMoving_mps || norm(s.w_WB) > kMoving_radps;
}

/// Cut or filled with blanks to `columns` characters of UTF-8.
std::string fit(std::string_view text, int columns) {
  std::string out;
  int count = 0;
  for (const char c : text) {
    const bool begins_character = (static_cast<unsigned char>(c) & 0xC0) != 0x80;
    if (begins_character && count == columns) break;
    if (begins_character) ++count;
    out += c;
  }
  return out + std::string(static_cast<std::size_t>(columns - count), ' ');
}

/// One cell a m/s, in eighths of a cell.
std::string bar(double speed_mps, const Style& style) {
  if (!style.has_utf8 || style.columns < kColumnsWithBar) return "";
  static constexpr std::array<const char*, 8> kEighths = {"", "▏", "▎", "▍", "▌", "▋", "▊", "▉"};
  const double share = std::clamp(speed_mps / kFullBar_mps, 0.0, 1.0);
  const auto eighths = static_cast<std::size_t>(std::lround(share * kBarCells * 8));
  std::string cells;
  for (std::size_t i = 0; i < eighths / 8; ++i) cells += "█";
  return "  " + cells + kEighths[eighths % 8];
}

std::string kind_of(const BodyState& state, const Event* about) {
  std::string shape = "body";
  if (about) shape = word_of(about->shape.kind);
  if (shape == "none") shape = "point";
  if (shape == "half_space") shape = "half-space";
  if (state.kind == BodyKind::kinematic) return "kinematic " + shape;
  return state.kind == BodyKind::fixed ? "static " + shape : shape;
}

std::string title(const Client& client, const Style& style) {
  const WorldStatus& s = client.status();
  std::string text = format("tick %lld   %.1f s   ", wide(client.tick()), client.time_s());
  text += s.paused ? "paused" : s.lockstep ? "lockstep" : format("x%.2f", s.real_time_factor);
  text += format("   %zu bodies   %lld contacts   %lld chunks lost", client.bodies().size(),
                 wide(s.contacts), wide(client.statistics().chunks_lost));
  if (s.overloaded) text += "   overloaded";
  if (client.has_ended()) {
    text += "   end of the recording";
  } else if (!client.is_alive()) {
    text += "   no heartbeat";
  }
  return style.bold(s.name.empty() ? "recording" : s.name) + "   " + text;
}

std::string head(const Style& style) {
  std::string text = format("%4s  %-*s%-13s%8s%8s%8s%8s%8s touch", "id", kNameColumns, "name",
                            "kind", "x m", "y m", "z m", "m/s", "rad/s");
  return style.dim(text);
}

std::string row(const Client& client, const BodyView& view, const Style& style) {
  const BodyState& s = view.state;
  const Vec3& p = s.p_WBo;
  const double speed_mps = norm(s.v_WBcm);
  const char* touch = s.in_contact ? (style.has_utf8 ? "●" : "*") : " ";
  if (s.asleep) touch = style.has_utf8 ? "○" : "z";
  std::string text = format("%4lld  %s%s%8.2f%8.2f%8.2f%8.2f%8.2f ", wide(s.body.value),
                            fit(client.name(s.body), kNameColumns).c_str(),
                            fit(kind_of(s, client.about(s.body)), 13).c_str(), tidy(p.x), tidy(p.y),
                            tidy(p.z), speed_mps, norm(s.w_WB));
  text += s.quarantined ? "quarantined" : touch + bar(speed_mps, style);
  return is_moving(s) ? text : style.dim(text);
}

/// Bodies that may move, at most `most`: rather those in motion, then the youngest.
std::vector<const BodyView*> chosen(const Client& client, std::size_t most) {
  std::vector<const BodyView*> views;
  for (const BodyView& view : client.bodies()) {
    if (view.state.kind != BodyKind::fixed) views.push_back(&view);
  }
  if (views.size() <= most) return views;
  const auto by_id = [](auto* a, auto* b) { return a->state.body < b->state.body; };
  std::sort(views.begin(), views.end(), [&](auto* a, auto* b) {
    const bool a_moves = is_moving(a->state), b_moves = is_moving(b->state);
    return a_moves != b_moves ? a_moves : by_id(b, a);
  });
  views.resize(most);
  std::sort(views.begin(), views.end(), by_id);
  return views;
}

std::string tell(const Client& client, const Event& event) {
  static constexpr std::array<const char*, 6> kWords = {"came", "gone",  "quarantined",
                                                        "seen", "slept", "woke"};
  const double rate_hz = client.status().rate_hz;
  const double time_s = rate_hz > 0 ? static_cast<double>(event.tick) / rate_hz : 0;
  const std::string name =
      event.name.empty() ? format("body %lld", wide(event.body.value)) : event.name;
  return format("%7.1f s  %s %s", time_s, name.c_str(),
                kWords.at(static_cast<std::size_t>(event.kind)));
}

}  // namespace

std::vector<std::string> draw(const Client& client, const std::deque<Event>& news,
                              const Style& style) {
  std::vector<std::string> lines = {title(client, style), "", head(style)};
  const std::size_t frame = lines.size() + news.size() + 3;
  const auto rows = static_cast<std::size_t>(std::max(style.rows, 0));
  const auto views = chosen(client, rows > frame ? rows - frame : 1);
  for (const BodyView* view : views) lines.push_back(row(client, *view, style));
  if (const std::size_t rest = client.bodies().size() - views.size(); rest > 0) {
    lines.push_back(style.dim(format("      and %zu more", rest)));
  }
  if (!news.empty()) lines.emplace_back();
  for (const Event& event : news) lines.push_back(style.dim(tell(client, event)));
  return lines;
}

}  // namespace cradle::tool
