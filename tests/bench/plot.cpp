#include "tests/bench/plot.h"

#include <spawn.h>
#include <sys/wait.h>

#include "server/trace.h"

extern char** environ;

namespace cradle::bench {

void plot(const std::filesystem::path& folder, const std::string& name) {
  // gnuplot resolves names from where it runs: its own cd comes first.
  std::string program = "gnuplot", option = "-e", change = "cd '" + folder.string() + "'";
  std::string file = name + ".gp";
  std::array<char*, 5> arguments{program.data(), option.data(), change.data(), file.data(),
                                 nullptr};
  pid_t child = 0;
  int status = 127 << 8;  // not found, as a shell has it
  if (posix_spawnp(&child, "gnuplot", nullptr, nullptr, arguments.data(), environ) == 0) {
    waitpid(child, &status, 0);
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 127) {
    throw PlotError(
        "no gnuplot (package gnuplot-nox): no diagrams; data, scripts and table are in " +
        folder.string());
  }
  if (status != 0) throw PlotError("gnuplot failed on " + (folder / file).string());
}

void write_file(const std::filesystem::path& path, const std::string& text) {
  Output output(path.string());
  output.write(text);
  output.finish();
}

}  // namespace cradle::bench
