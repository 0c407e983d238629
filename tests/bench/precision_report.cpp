#include "tests/bench/precision_report.h"

#include <array>
#include <cmath>
#include <filesystem>

#include "tests/bench/plot.h"

namespace cradle::bench {
namespace {

constexpr std::array<double, 5> kPrecisionErrors{1e-2, 1e-4, 1e-6, 1e-8, 1e-10};

/// Two diagrams of one case: error over time, and over counted work.
std::string precision_script(const PrecisionCase& which, std::span<const PrecisionCurve> curves) {
  const std::string name(which.name);
  std::string text =
      "set terminal svg size 640,420 font 'sans,12' background 'white'\n"
      "set logscale xy\nset format '10^{%T}'\nset grid\nset key outside right top\n"
      "set datafile missing 'nan'\nset title '" +
      name + ": " + std::string(which.about) +
      "'\nset ylabel 'error: " + std::string(which.error_kind) + "'\nset yrange [1e-15:10]\n";
  for (const auto& [file, column, label] :
       {std::tuple{"time", "4", "ns a body and simulated second"},
        {"work", "3", "evaluations of force and torque a simulated second"}}) {
    text += "set output '" + name + "_" + file + ".svg'\nset xlabel '" + label + "'\nplot \\\n";
    for (std::size_t i = 0; i < curves.size(); ++i) {
      std::string title = curves[i].scheme;
      for (char& c : title) c = c == '_' ? ' ' : c;
      text += "  '" + name + ".dat' index " + std::to_string(i) + " using " + column +
              ":($2 < 1e-15 ? 1e-15 : $2) with linespoints title '" + title + "'" +
              (i + 1 < curves.size() ? ", \\\n" : "\n");
    }
  }
  return text;
}

}  // namespace

std::string data_text(std::span<const PrecisionCurve> curves) {
  std::string text;
  for (const PrecisionCurve& curve : curves) {
    text += (text.empty() ? "# " : "\n\n# ") + curve.scheme + ": step_s error evaluations ns\n";
    for (const PrecisionPoint& p : curve.points) {
      const double error = std::isfinite(p.error) ? p.error : NAN;
      text += formatted("%.6g %.6g %.6g %.4g\n", p.step_s, error, p.evaluations, p.ns);
    }
  }
  return text;
}

std::string table_head() {
  std::string head = "| case, kind of error |", line = "\n|---|";
  for (const double error : kPrecisionErrors) {
    head += formatted(" %.0e |", error);
    line += "---|";
  }
  return head + line + '\n';
}

std::string table_line(const PrecisionCase& which, std::span<const PrecisionCurve> curves) {
  std::string text = "| " + std::string(which.name) + " " + std::string(which.error_kind) + " |";
  for (const double error : kPrecisionErrors) {
    const Cheapest best = cheapest(curves, error);
    text +=
        best.scheme.empty()
            ? std::string(" none |")
            : " " + best.scheme +
                  formatted(", %.3g ms: %.0f, ", 1e3 * best.point.step_s, best.point.evaluations) +
                  formatted(best.point.ns < 1e5 ? "%.2g µs |" : "%.0f µs |", 1e-3 * best.point.ns);
  }
  return text + '\n';
}

void write_precision_report(const std::string& folder_name, double evaluations_max) {
  const std::filesystem::path folder(folder_name);
  std::filesystem::create_directories(folder);
  std::string table = table_head();
  for (const PrecisionCase& which : precision_cases()) {
    const std::vector<PrecisionCurve> curves = sweep(which, evaluations_max);
    const std::string name(which.name);
    write_file(folder / (name + ".dat"), data_text(curves));
    write_file(folder / (name + ".gp"), precision_script(which, curves));
    table += table_line(which, curves);
  }
  write_file(folder / "table.md", table);
  for (const PrecisionCase& which : precision_cases()) plot(folder, std::string(which.name));
}

}  // namespace cradle::bench
