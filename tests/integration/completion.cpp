// Completion in a real bash: it offers what the help lists.
#include <catch2/catch.hpp>
#include <fstream>
#include <sstream>

#include "tests/integration/help.h"
#include "tests/integration/installed.h"

namespace cradle {
namespace {

/// What Tab offers at the end of `words`, of which the last may be empty.
std::set<std::string> offered(const std::vector<std::string>& words,
                              const std::string& folder = CRADLE_SOURCE_DIR) {
  std::string line = "cd '" + folder +
                     "' && source '" CRADLE_SOURCE_DIR
                     "/server/package/completion.bash' && COMP_WORDS=(";
  for (const std::string& word : words) line += " '" + word + "'";
  line += ") COMP_CWORD=" + std::to_string(words.size() - 1);
  line += " && _cradle \"$COMP_WORDS\" && printf '%s\\n' \"${COMPREPLY[@]}\"";
  const Finished finished = run({"/bin/bash", "--norc", "-c", line});
  CAPTURE(line, finished.errors);
  CHECK(finished.exit_code == 0);
  CHECK(finished.errors.empty());
  std::set<std::string> words_offered;
  std::istringstream stream(finished.output);
  for (std::string word; std::getline(stream, word);) {
    if (!word.empty()) words_offered.insert(word);
  }
  return words_offered;
}

using Words = std::set<std::string>;

const std::string kDaemon = CRADLE_BIN_DIR "/cradled";
const std::string kTool = CRADLE_BIN_DIR "/cradle";

}  // namespace

TEST_CASE("completion offers every subcommand, and every option of each") {
  for (const std::string program : {"cradled", "cradle"}) {
    const std::string path = CRADLE_BIN_DIR "/" + program;
    const std::vector<std::string> subcommands = subcommands_of(program);
    CHECK(offered({path, ""}) == Words(subcommands.begin(), subcommands.end()));
    CHECK(offered({path, "--"}) == flags_of(program));
    for (const std::string& subcommand : subcommands) {
      CAPTURE(program, subcommand);
      Words expected = flags_of(program, subcommand);
      // The tool takes its own options after the subcommand, too.
      if (program == "cradle") expected.merge(flags_of(program));
      CHECK(offered({path, subcommand, "--"}) == expected);
    }
  }
}

TEST_CASE("completion tells options, values and subcommands apart") {
  CHECK(offered({kTool, "--world", "watch", "sp"}) == Words{"spawn"});
  CHECK(offered({kTool, "--world", "=", "watch", "sp"}) == Words{"spawn"});
  CHECK(offered({kTool, "spawn", "--shape", ""}) == Words{"box", "capsule", "cone", "cylinder",
                                                          "ellipsoid", "half_space", "polygon",
                                                          "sphere"});
  CHECK(offered({kTool, "spawn", "--kind", "=", "st"}) == Words{"static"});
  CHECK(offered({kTool, "--world", ""}).empty());
  CHECK(offered({kTool, "remove", ""}).empty());
  CHECK(offered({kTool, "push", "ball", "--until"}) == Words{"--until-cleared"});
}

TEST_CASE("completion offers scenes where a scene is wanted, and any file elsewhere") {
  const Folder folder;
  for (const char* name : {"a.toml", "b.csv"}) std::ofstream(folder.path() / name) << "\n";
  std::filesystem::create_directory(folder.path() / "more");
  const std::string here = folder.path().string();
  CHECK(offered({kDaemon, "serve", "--scene", ""}, here) == Words{"a.toml", "more"});
  CHECK(offered({kDaemon, "serve", "--config", "a"}, here) == Words{"a.toml"});
  CHECK(offered({kDaemon, "simulate", ""}, here) == Words{"a.toml", "more"});
  CHECK(offered({kDaemon, "simulate", "--trace", ""}, here) == Words{"a.toml", "b.csv", "more"});
  CHECK(offered({kDaemon, "simulate", "--duration", ""}, here).empty());
}

}  // namespace cradle
