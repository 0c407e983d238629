#include "server/mesh_file.h"

#include <cradle/limits.h>

#include <algorithm>
#include <array>
#include <charconv>

namespace cradle {
namespace {

constexpr std::string_view kPassedOver[] = {"vt", "vn", "o", "g", "s", "usemtl", "mtllib"};
constexpr std::string_view kSpace = " \t\r";

class ObjReader {
 public:
  explicit ObjReader(const std::string& name) : name_(name) {}

  MeshFile read(std::string_view text) {
    while (!text.empty()) {
      const std::size_t end = text.find('\n');
      ++line_;
      take_line(text.substr(0, end));
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    }
    return std::move(file_);
  }

 private:
  void take_line(std::string_view line) {
    line = line.substr(0, line.find('#'));
    words_.clear();
    while (true) {
      const std::size_t begin = line.find_first_not_of(kSpace);
      if (begin == std::string_view::npos) break;
      line.remove_prefix(begin);
      words_.push_back(line.substr(0, line.find_first_of(kSpace)));
      line.remove_prefix(words_.back().size());
    }
    if (words_.empty()) return;
    if (words_[0] == "v") {
      take_vertex();
    } else if (words_[0] == "f") {
      take_face();
    } else if (std::find(std::begin(kPassedOver), std::end(kPassedOver), words_[0]) ==
               std::end(kPassedOver)) {
      refuse("'" + std::string(words_[0]) +
             "' is not understood; known are v, f and what says "
             "nothing about the surface");
    }
  }

  void take_vertex() {
    if (words_.size() != 4) refuse("a vertex has three coordinates");
    Vector v;
    for (int k = 0; k < 3; ++k) v(k) = number(words_[static_cast<std::size_t>(k) + 1]);
    if (file_.vertices.size() >= static_cast<std::size_t>(limits::kPoints)) {
      refuse("too many vertices");
    }
    file_.vertices.push_back(v);
  }

  void take_face() {
    if (words_.size() < 4) refuse("a face has three corners or more");
    std::vector<std::int32_t> corners;
    for (std::size_t k = 1; k < words_.size(); ++k) corners.push_back(corner(words_[k]));
    if (corners.size() > 3 && !is_convex(corners)) {
      refuse("a face of more than three corners must be convex; cut it into triangles");
    }
    for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
      if (file_.triangles.size() >= static_cast<std::size_t>(limits::kTriangles)) {
        refuse("too many triangles");
      }
      file_.triangles.push_back({corners[0], corners[k], corners[k + 1]});
    }
  }

  /// Whether the corners turn one way only: then a fan of triangles covers the face, and no more.
  bool is_convex(const std::vector<std::int32_t>& corners) const {
    const std::size_t n = corners.size();
    const auto at = [&](std::size_t k) -> const Vector& {
      return file_.vertices[static_cast<std::size_t>(corners[k % n])];
    };
    Vector area = Vector::Zero();
    for (std::size_t k = 1; k + 1 < n; ++k) area += (at(k) - at(0)).cross(at(k + 1) - at(0));
    const double least = -1e-9 * area.squaredNorm();
    for (std::size_t k = 0; k < n; ++k) {
      const Vector corner = (at(k + 1) - at(k)).cross(at(k + 2) - at(k + 1));
      const Vector fan = k == 0 || k + 1 >= n ? area : (at(k) - at(0)).cross(at(k + 1) - at(0));
      if (corner.dot(area) < least || fan.dot(area) < least) return false;
    }
    return true;
  }

  /// The index of the vertex that a corner names.
  std::int32_t corner(std::string_view word) const {
    const std::string_view digits = word.substr(0, word.find('/'));
    const auto count = static_cast<std::int64_t>(file_.vertices.size());
    std::int64_t value = 0;
    const auto read = std::from_chars(digits.begin(), digits.end(), value);
    if (read.ec != std::errc() || read.ptr != digits.end() || value == 0) {
      refuse("'" + std::string(word) + "' is no corner");
    }
    const std::int64_t at = value > 0 ? value - 1 : count + value;
    if (at < 0 || at >= count) {
      refuse("corner " + std::to_string(value) + " of " + std::to_string(count) +
             " vertices so far");
    }
    return static_cast<std::int32_t>(at);
  }

  double number(std::string_view word) const {
    double value = 0;
    const auto read = std::from_chars(word.begin(), word.end(), value);
    if (read.ec != std::errc() || read.ptr != word.end()) {
      refuse("'" + std::string(word) + "' is no number");
    }
    return value;
  }

  [[noreturn]] void refuse(const std::string& reason) const {
    throw MeshFileError(name_ + ":" + std::to_string(line_) + ": " + reason);
  }

  std::string name_;
  std::int64_t line_ = 0;
  std::vector<std::string_view> words_;
  MeshFile file_;
};

}  // namespace

std::vector<std::vector<double>> parse_heights(std::string_view text, const std::string& name) {
  std::vector<std::vector<double>> rows;
  for (std::int64_t line = 1; !text.empty(); ++line) {
    const std::size_t end = text.find('\n');
    std::string_view rest = text.substr(0, end);
    rest = rest.substr(0, rest.find('#'));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    std::vector<double> row;
    while (true) {
      const std::size_t begin = rest.find_first_not_of(" \t\r,");
      if (begin == std::string_view::npos) break;
      rest.remove_prefix(begin);
      const std::string_view word = rest.substr(0, rest.find_first_of(" \t\r,"));
      rest.remove_prefix(word.size());
      double value = 0;
      const auto read = std::from_chars(word.begin(), word.end(), value);
      if (read.ec != std::errc() || read.ptr != word.end()) {
        throw MeshFileError(name + ":" + std::to_string(line) + ": '" + std::string(word) +
                            "' is no number");
      }
      row.push_back(value);
    }
    if (!row.empty()) rows.push_back(std::move(row));
  }
  return rows;
}

MeshFile parse_obj(std::string_view text, const std::string& name) {
  return ObjReader(name).read(text);
}

}  // namespace cradle
