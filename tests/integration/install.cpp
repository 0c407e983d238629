// What `cmake --install` leaves is all that a game needs: the installed client library, built into
// a small program by CMake and by pkg-config, with other flags than ours, from a prefix that moves.
#include <catch2/catch.hpp>
#include <fstream>
#include <regex>
#include <sstream>

#include "tests/integration/installed.h"

namespace cradle {
namespace {

namespace fs = std::filesystem;

/// What a consumer needs when our libraries are built with sanitizers.
std::string sanitizer_flags() {
  const std::string sanitizers = CRADLE_SANITIZE;
  return sanitizers.empty() ? "" : " -fsanitize=" + sanitizers;
}

const std::string kWarnings = " -Wall -Wextra -Wpedantic -Wconversion -Werror";

/// tests/integration/consumer, away from the source tree.
fs::path copy_consumer(const Folder& folder) {
  const fs::path copy = folder.path() / "consumer";
  if (!fs::exists(copy)) fs::copy(CRADLE_SOURCE_DIR "/tests/integration/consumer", copy);
  return copy;
}

/// Configures and builds it in a fresh folder; the program.
fs::path build_consumer(const Folder& folder, const fs::path& prefix, const std::string& kind,
                        const std::string& flags) {
  const fs::path build = folder.path() / "consumer-build";
  fs::remove_all(build);
  const std::string is_shared = kind == "shared" ? "ON" : "OFF";
  type(CRADLE_CMAKE " -S '" + copy_consumer(folder).string() + "' -B '" + build.string() +
       "' -G Ninja -DCMAKE_CXX_COMPILER=" CRADLE_CXX " -DBUILD_SHARED_LIBS=" + is_shared +
       " '-DCMAKE_PREFIX_PATH=" + prefix.string() + "' '-DCMAKE_CXX_FLAGS=" + flags + kWarnings +
       sanitizer_flags() + "'");
  type(CRADLE_CMAKE " --build '" + build.string() + "'");
  CHECK_THAT(content(build / "CMakeCache.txt"),
             Catch::Matchers::Contains("cradle_DIR:PATH=" + prefix.string() + "/"));
  return build / "consumer";
}

/// The libraries that a program asks the loader for.
std::string needed_by(const fs::path& program) {
  return type("readelf -d '" + program.string() + "' | grep NEEDED");
}

void check_kind(const fs::path& consumer, const std::string& kind) {
  const std::string needed = needed_by(consumer);
  const bool needs_ours = needed.find("libcradle-client.so.0") != std::string::npos;
  CHECK(needs_ours == (kind == "shared"));
  CHECK(needed.find("fcl") == std::string::npos);
}

std::vector<std::string> kinds() {
  return CRADLE_HAS_SHARED ? std::vector<std::string>{"static", "shared"}
                           : std::vector<std::string>{"static"};
}

}  // namespace

TEST_CASE("a game is built of an installed prefix, plain and for this processor, and runs") {
  const Folder folder;
  const fs::path prefix = folder.path() / "prefix";
  install_into(prefix);
  for (const std::string& kind : kinds()) {
    for (const std::string flags : {"", "-march=native"}) {
      CAPTURE(kind, flags);
      const fs::path consumer = build_consumer(folder, prefix, kind, flags);
      check_kind(consumer, kind);
      check_consumer(consumer, prefix);
    }
  }
}

TEST_CASE("a prefix that was moved serves as before, and pkg-config finds its way, too") {
  const Folder folder;
  install_into(folder.path() / "first");
  const fs::path prefix = folder.path() / "moved here";
  fs::rename(folder.path() / "first", prefix);
  const std::string kind = kinds().back();
  check_consumer(build_consumer(folder, prefix, kind, ""), prefix);

  const fs::path libraries = prefix / CRADLE_LIBDIR;
  const auto build = [&](const std::string& options) {
    type("cd '" + folder.path().string() + "' && export PKG_CONFIG_PATH='" +
         (libraries / "pkgconfig").string() + "' && eval " CRADLE_CXX +
         " -std=c++20 consumer/main.cpp -o by-pkg-config" + sanitizer_flags() +
         " $(pkg-config --cflags --libs " + options + " cradle-client)");
    return folder.path() / "by-pkg-config";
  };
  const fs::path linked = build("");
  check_kind(linked, kind);
  check_consumer(linked, prefix, "LD_LIBRARY_PATH='" + libraries.string() + "'");

  // Where only the static library is, --static gives what it needs.
  for (const fs::path& file : files_below(libraries)) {
    if (file.filename().string().starts_with("libcradle-client.so")) fs::remove(file);
  }
  const fs::path alone = build("--static");
  check_kind(alone, "static");
  check_consumer(alone, prefix);
}

TEST_CASE("an installation keeps the configuration that is there") {
  const Folder folder;
  const fs::path file = folder.path() / "etc/cradle/cradled.toml";
  fs::create_directories(file.parent_path());
  std::ofstream(file) << "world = 'mine'\n";
  install_into(folder.path());
  CHECK(content(file) == "world = 'mine'\n");
}

TEST_CASE("what is installed tells neither where it was built nor where it is") {
  const Folder folder;
  const fs::path prefix = folder.path() / "prefix";
  install_into(prefix);
  const std::vector<fs::path> files = files_below(prefix);
  CHECK(files.size() > 30);
  for (const fs::path& file : files) {
    CAPTURE(file);
    const std::string bytes = content(file);
    CHECK(bytes.find(CRADLE_SOURCE_DIR) == std::string::npos);
    CHECK(bytes.find(CRADLE_BUILD_DIR) == std::string::npos);
    CHECK(bytes.find("/liblcm.so") == std::string::npos);  // it is looked for where it is needed
    const bool is_unit = file.extension() == ".service";   // these name the daemon
    CHECK((bytes.find(prefix.string()) != std::string::npos) == is_unit);
    CHECK((bytes.find(prefix.string() + "/sbin/cradled") != std::string::npos) == is_unit);
  }
}

TEST_CASE("each installed header compiles alone and shows nothing of LCM or Eigen") {
  const Folder folder;
  const fs::path prefix = folder.path() / "prefix";
  install_into(prefix);
  const std::string compile =
      CRADLE_CXX " -x c++ -fsyntax-only -I '" + (prefix / "include").string() + "'";
  int headers = 0;
  for (const fs::path& file : files_below(prefix / "include")) {
    CAPTURE(file);
    ++headers;
    const std::string include = "echo '#include <cradle/" + file.filename().string() + ">' | ";
    type(include + compile + " -std=c++20" + kWarnings + " -");
    const std::string reads = type(include + compile + " -std=c++20 -M -");
    CHECK_FALSE(std::regex_search(
        reads, std::regex("/(lcm|eigen3?|glib|fcl|cradle_wire)", std::regex_constants::icase)));
  }
  CHECK(headers >= 7);
  const Finished old =
      run({"/bin/sh", "-c", "echo '#include <cradle/client.h>' | " + compile + " -std=c++17 -"});
  CHECK(old.exit_code != 0);
  CHECK_THAT(old.errors, Catch::Matchers::Contains("-std=c++20"));
}

TEST_CASE("the shared library exports what its headers declare, and nothing else") {
  if (!CRADLE_HAS_SHARED) return;
  const Folder folder;
  install_into(folder.path());
  const fs::path library = folder.path() / CRADLE_LIBDIR / "libcradle-client.so";
  std::istringstream lines(type("nm -DC --defined-only '" + library.string() + "'"));
  const std::regex is_public(
      "[0-9a-f]+ T cradle::(Client::.*|ClientOptions::from_environment\\(.*|"
      "to_string\\(cradle::Result\\)|recording_url\\(.*)@@CRADLE_CLIENT_0|[0-9a-f]+ A "
      "CRADLE_CLIENT_0");
  int functions = 0;
  for (std::string line; std::getline(lines, line); ++functions) {
    CAPTURE(line);
    CHECK(std::regex_match(line, is_public));
    CHECK(line.find("T cradle::Client::Impl::") == std::string::npos);
  }
  CHECK(functions > 41);
}

TEST_CASE("a package that cannot be had is refused with the reason") {
  const Folder folder;
  const fs::path prefix = folder.path() / "prefix";
  install_into(prefix);
  const auto refusal = [&](const std::string& request) {
    const fs::path list = folder.path() / "wrong" / "CMakeLists.txt";
    fs::remove_all(list.parent_path());
    fs::create_directory(list.parent_path());
    type(
        "printf '%s\\n' 'cmake_minimum_required(VERSION 3.16)' 'project(wrong CXX)' "
        "'find_package(cradle " +
        request + ")' >'" + list.string() + "'");
    const Finished finished =
        run({"/bin/sh", "-c",
             CRADLE_CMAKE " -S '" + list.parent_path().string() + "' -B '" +
                 (list.parent_path() / "build").string() +
                 "' -G Ninja -DCMAKE_CXX_COMPILER=" CRADLE_CXX " '-DCMAKE_PREFIX_PATH=" +
                 prefix.string() + "'"});
    CHECK(finished.exit_code != 0);
    return std::regex_replace(finished.errors, std::regex("\\s+"), " ");
  };
  using Catch::Matchers::Contains;
  CHECK_THAT(refusal("0.99 REQUIRED"), Contains("version"));
  CHECK_THAT(refusal("REQUIRED COMPONENTS dynamic"), Contains("'dynamic' cannot be had"));
  CHECK_THAT(refusal("REQUIRED COMPONENTS shared static"), Contains("only one of them"));
}

}  // namespace cradle
