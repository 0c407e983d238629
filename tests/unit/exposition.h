/// Reads Prometheus' text format 0.0.4 strictly, and checks what its conventions ask for.
#pragma once

#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace cradle {

struct Exposition {
  std::map<std::string, double> samples;  ///< by name and labels, as written
  std::vector<std::string> faults;
};

class ExpositionReader {
 public:
  explicit ExpositionReader(const std::string& text) {
    if (text.empty() || text.back() != '\n') fault("does not end with a line's end");
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) read(line);
    end_family();
  }
  Exposition take() { return std::move(result_); }

 private:
  struct Bucket {
    double bound = 0, count = 0;
  };

  void fault(const std::string& what) { result_.faults.push_back(family_ + ": " + what); }

  void read(const std::string& line) {
    static const std::regex help("# HELP ([a-z_]+) (.+)");
    static const std::regex type("# TYPE ([a-z_]+) (counter|gauge|histogram)");
    static const std::regex sample(
        R"re(([a-z_]+)(\{(?:[a-z_]+="[^"\\\n]*"(?:,(?!\}))?)+\})? (-?(?:[0-9.]+(?:e[-+][0-9]+)?)))re");
    std::smatch match;
    if (std::regex_match(line, match, help)) {
      end_family();
      family_ = match[1];
      if (!families_.insert(family_).second) fault("a second time");
      type_.clear();
    } else if (std::regex_match(line, match, type)) {
      if (match[1] != family_ || !type_.empty()) fault("TYPE is not right after HELP");
      type_ = match[2];
      if ((type_ == "counter") != family_.ends_with("_total")) fault("_total says counter");
    } else if (std::regex_match(line, match, sample)) {
      take_sample(match[1], match[2], std::stod(match[3]));
    } else {
      fault("cannot read: " + line);
    }
  }

  void take_sample(const std::string& name, const std::string& labels, double value) {
    if (type_.empty()) fault("has no TYPE");
    has_samples_ = true;
    if (!result_.samples.emplace(name + labels, value).second) fault("twice: " + name + labels);
    if (type_ == "counter" && value < 0) fault("below zero");
    if (type_ != "histogram") {
      if (name != family_) fault("foreign sample " + name);
      return;
    }
    static const std::regex le(R"re((?:,|\{)le="([^"]+)"\}$)re");
    std::smatch bound;
    if (name == family_ + "_bucket" && std::regex_search(labels, bound, le)) {
      const std::string at = bound[1];
      std::string rest = labels.substr(0, static_cast<std::size_t>(bound.position(0)));
      if (!rest.empty()) rest += '}';
      buckets_[rest].push_back({at == "+Inf" ? 1e300 : std::stod(at), value});
    } else if (name == family_ + "_count") {
      counts_[labels] = value;
    } else if (name == family_ + "_sum") {
      sums_[labels] = value;
    } else {
      fault("foreign sample " + name);
    }
  }

  void end_family() {
    if (!family_.empty() && !has_samples_) fault("has no samples");
    for (const auto& [labels, buckets] : buckets_) {
      for (std::size_t i = 1; i < buckets.size(); ++i) {
        if (buckets[i].bound <= buckets[i - 1].bound) fault("bounds do not ascend");
        if (buckets[i].count < buckets[i - 1].count) fault("buckets are not cumulative");
      }
      if (buckets.back().bound != 1e300) fault("has no +Inf");
      if (!counts_.contains(labels) || counts_[labels] != buckets.back().count) {
        fault("+Inf is not the count");
      }
      if (!sums_.contains(labels)) fault("has no sum");
    }
    if (type_ == "histogram" && buckets_.empty()) fault("has no buckets");
    buckets_.clear();
    counts_.clear();
    sums_.clear();
    has_samples_ = false;
  }

  Exposition result_;
  std::string family_, type_;
  bool has_samples_ = false;
  std::set<std::string> families_;
  std::map<std::string, std::vector<Bucket>> buckets_;  ///< by the other labels
  std::map<std::string, double> counts_, sums_;
};

inline Exposition read_exposition(const std::string& text) { return ExpositionReader(text).take(); }

}  // namespace cradle
