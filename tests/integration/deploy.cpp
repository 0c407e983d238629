// What server/deploy/ brings: the units, as systemd reads them, and their command lines, typed. And
// what they rely on: a daemon of no privilege whose tree is read-only.
#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "tests/integration/daemon.h"

namespace cradle {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

const std::string kUnits[] = {"cradled.service", "cradled@.service"};
const std::string kProgram = CRADLE_BIN_DIR "/cradled";

std::string file_text(const fs::path& path) {
  std::ifstream stream(path);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

/// The unit as it is installed, but for where the program is.
std::string unit_text(const std::string& name) {
  return replaced(file_text(fs::path(CRADLE_SOURCE_DIR "/server/deploy") / name),
                  "/usr/sbin/cradled", kProgram);
}

/// A folder that everybody may enter, removed at the end whatever its permissions are then.
class OpenFolder {
 public:
  OpenFolder() : path_(new_folder()) { fs::permissions(path_, fs::perms(0755)); }
  ~OpenFolder() {
    set_permissions(fs::perms::owner_write, fs::perm_options::add);
    fs::remove_all(path_);
  }
  OpenFolder(const OpenFolder&) = delete;
  OpenFolder& operator=(const OpenFolder&) = delete;

  fs::path operator/(const std::string& name) const { return path_ / name; }

  void set_permissions(fs::perms permissions, fs::perm_options how) const {
    fs::permissions(path_, permissions, how);
    for (const auto& entry : fs::recursive_directory_iterator(path_)) {
      fs::permissions(entry.path(), permissions, how);
    }
  }

  /// Every file with the time of its last change.
  std::map<std::string, fs::file_time_type> listing() const {
    std::map<std::string, fs::file_time_type> all;
    for (const auto& entry : fs::recursive_directory_iterator(path_)) {
      all[entry.path().string()] = entry.last_write_time();
    }
    return all;
  }

 private:
  fs::path path_;
};

/// True if a shell in a mount namespace of its own can do that.
bool can_in_mounts_of_its_own(const std::string& command) {
  return run({"/usr/bin/unshare", "-rm", "sh", "-c", command}, 10s).exit_code == 0;
}

/// The words of a unit's ExecStart=, of the instance "test".
std::string command_line(const std::string& unit) {
  std::istringstream lines(replaced(unit_text(unit), "%i", "test"));
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("ExecStart=")) return line.substr(line.find('=') + 1);
  }
  return {};
}

}  // namespace

TEST_CASE("systemd finds nothing wrong in the units, and them hardened") {
  if (run({"/usr/bin/env", "systemd-analyze", "--version"}).exit_code != 0) {
    WARN("no systemd-analyze here");
    return;
  }
  const OpenFolder folder;
  for (const std::string& unit : kUnits) {
    CAPTURE(unit);
    const std::string file = (folder / unit).string();
    std::ofstream(file) << unit_text(unit);
    const Finished verified = run({"/usr/bin/env", "systemd-analyze", "verify", "--man=no", file});
    CHECK(verified.exit_code == 0);
    CHECK(verified.output + verified.errors == "");  // unknown keys are only told of
    // 0 is safe, 100 is not; what is left is the network.
    const Finished secure = run({"/usr/bin/env", "systemd-analyze", "security", "--offline=true",
                                 "--threshold=15", "--no-pager", file});
    CAPTURE(secure.output, secure.errors);
    CHECK(secure.exit_code == 0);
  }
}

TEST_CASE("the units differ only in whose world they run") {
  std::string texts[2];
  for (int i = 0; i < 2; ++i) {
    std::istringstream lines(unit_text(kUnits[i]));
    for (std::string line; std::getline(lines, line);) {
      const bool differs = line.starts_with("#   ") || line.starts_with("Description=") ||
                           line.starts_with("ExecStart=");
      if (!differs) texts[i] += line + '\n';
    }
    texts[i].erase(0, texts[i].find("[Unit]"));
  }
  CHECK(texts[0] == texts[1]);
}

TEST_CASE("the units' command lines run the worlds that /etc/cradle describes") {
  const std::string mount = "mount -t tmpfs none /etc && mkdir /etc/cradle";
  if (!can_in_mounts_of_its_own(mount)) {
    WARN("no mounts of our own here");
    return;
  }
  const std::pair<std::string, std::string> files[] = {{"cradled.service", "cradled.toml"},
                                                       {"cradled@.service", "test.toml"}};
  for (const auto& [unit, file] : files) {
    CAPTURE(unit);
    std::string settings = "lcm_url = '" + own_url() + "'\n" + "bodies_max = 3\n";
    if (unit == "cradled.service") settings += "world = 'test'\n";
    Process daemon(
        {"/usr/bin/unshare", "-rm", "sh", "-c",
         mount + " && printf %s \"$1\" >/etc/cradle/" + file + " && exec " + command_line(unit),
         "sh", settings});
    const auto client = connect();
    CAPTURE(daemon.errors());
    REQUIRE(client);
    for (int i = 0; i < 3; ++i) CHECK(spawn_ball(*client, {3.0 * i, 0, 0}));
    CHECK_FALSE(spawn_ball(*client, {9, 0, 0}));  // the file's limit
    daemon.signal(SIGTERM);
    CHECK(daemon.wait(5s).value_or(-1) == 0);
  }
  // An instance needs its file; the host's world does not.
  const Finished without = run({"/usr/bin/unshare", "-rm", "sh", "-c",
                                mount + " && exec " + command_line("cradled@.service")});
  CHECK(without.exit_code == 66);
  CHECK(without.errors == "cradled: /etc/cradle/test.toml: No such file or directory\n");
}

TEST_CASE("the daemon runs without privilege or home from a read-only tree, and writes no file") {
  const OpenFolder folder;
  fs::create_directories(folder / "bin");
  fs::create_directories(folder / "etc");
  fs::copy_file(kProgram, folder / "bin/cradled");
  fs::copy_file(CRADLE_SCENE_DIR "/demo.toml", folder / "etc/demo.toml");
  std::ofstream(folder / "etc/cradled.toml")
      << "world = 'test'\nscene = 'demo.toml'\nlcm_url = '" << own_url() << "'\n";
  folder.set_permissions(fs::perms(0222), fs::perm_options::remove);
  const auto before = folder.listing();

  // As nobody; where there is no such user, as somebody outside all users known.
  std::vector<std::string> arguments;
  std::string unprivileged;
  if (::geteuid() == 0) {
    unprivileged = "setpriv --reuid=65534 --regid=65534 --clear-groups --no-new-privs";
    if (run({"/bin/sh", "-c", unprivileged + " true"}).exit_code != 0) unprivileged = "unshare -U";
  }
  const std::string exec = "cd / && exec env -i " + unprivileged + ' ' +
                           (folder / "bin/cradled").string() + " serve --config " +
                           (folder / "etc/cradled.toml").string();
  const std::string read_only = "mount -o remount,bind,ro / && ";
  if (run({"/usr/bin/unshare", "-m", "sh", "-c", read_only + "! touch /cradle-test"}).exit_code ==
      0) {
    arguments = {"/usr/bin/unshare", "-m", "sh", "-c", read_only + exec};
  } else {
    WARN("no read-only file system here, only read-only folders");
    arguments = {"/bin/sh", "-c", exec};
  }

  Process daemon(arguments);
  const auto client = connect();
  CAPTURE(daemon.errors());
  REQUIRE(client);
  CHECK(spawn_ball(*client, {0, 0, 20}));
  REQUIRE(poll_until(*client, [&] { return client->status().bodies > 5; }));

  const fs::path process = fs::path("/proc") / std::to_string(daemon.id());
  CHECK_THAT(file_text(process / "status"), Catch::Matchers::Contains("CapEff:\t0000000000000000"));
  CHECK(fs::read_symlink(process / "cwd") == "/");
  std::set<fs::path> ours;  // what it has inherited, like the log of ctest
  for (const auto& entry : fs::directory_iterator("/proc/self/fd")) {
    std::error_code is_gone;  // that of this very walk
    ours.insert(fs::read_symlink(entry.path(), is_gone));
  }
  int descriptors = 0;
  for (const auto& entry : fs::directory_iterator(process / "fd")) {
    const std::string name = entry.path().filename().string();
    const bool is_standard = name == "0" || name == "1" || name == "2";
    if (is_standard || ours.contains(fs::read_symlink(entry.path()))) continue;
    std::string label, flags;
    std::ifstream info(process / "fdinfo" / name);
    info >> label >> label >> label >> flags;  // pos: N flags: OCTAL
    const bool is_file = fs::is_regular_file(entry.path());
    CAPTURE(fs::read_symlink(entry.path()));
    CHECK_FALSE((is_file && (std::stoi(flags, nullptr, 8) & O_ACCMODE) != O_RDONLY));
    ++descriptors;
  }
  CHECK(descriptors > 0);
  daemon.signal(SIGTERM);
  CHECK(daemon.wait(5s).value_or(-1) == 0);
  CHECK(folder.listing() == before);
}

}  // namespace cradle
