// The Debian packages: made, installed into a root of their own, used from there, and removed so
// that nothing is left. dpkg sees what this host has installed, so that dependencies are real.
#include <signal.h>

#include <catch2/catch.hpp>
#include <set>
#include <sstream>

#include "tests/integration/installed.h"

namespace cradle {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// `cpack` of this build; the folder with the packages.
fs::path make_packages(const Folder& folder) {
  const fs::path packages = folder.path() / "packages";
  type(CRADLE_CPACK " --config '" CRADLE_BUILD_DIR "/CPackConfig.cmake' -G DEB -B '" +
       packages.string() + "'");
  fs::remove_all(packages / "_CPack_Packages");
  return packages;
}

/// The path of the one package of this name.
std::string package_file(const fs::path& packages, const std::string& name) {
  std::string found;
  for (const fs::path& file : files_below(packages)) {
    if (file.filename().string().starts_with(name + "_")) found = file.string();
  }
  REQUIRE(!found.empty());
  return found;
}

std::string field(const std::string& package, const std::string& name) {
  return type("dpkg-deb -f '" + package + "' " + name);
}

/// A root with the package database of this host, but without its files.
class Root {
 public:
  explicit Root(const fs::path& folder) : root_(folder / "root"), admin_(folder / "admin") {
    fs::create_directories(root_);
    for (const char* name : {"info", "updates", "triggers"}) fs::create_directories(admin_ / name);
    fs::copy_file("/var/lib/dpkg/status", admin_ / "status");
  }

  const fs::path& path() const { return root_; }

  Finished dpkg(const std::string& arguments) const {
    // An ordinary user cannot give files to root, nor has the folders of ldconfig in his path.
    return run({"/bin/sh", "-c",
                "PATH=$PATH:/usr/sbin:/sbin dpkg --force-not-root --log=/dev/null --instdir='" +
                    root_.string() + "' --admindir='" + admin_.string() + "' " + arguments});
  }

  /// The state of a package, like "installed" or "config-files"; empty: not known.
  std::string state(const std::string& package) const {
    return run({"/bin/sh", "-c",
                "dpkg-query --admindir='" + admin_.string() + "' -W -f '${db:Status-Status}' '" +
                    package + "' 2>/dev/null"})
        .output;
  }

 private:
  fs::path root_, admin_;
};

const std::vector<std::string> kNames = {"libcradle-client0", "libcradle-client-dev", "cradled"};

}  // namespace

TEST_CASE("the Debian packages install, serve a world, and leave nothing when they are purged") {
  if (!fs::exists("/var/lib/dpkg/status") || !CRADLE_HAS_SHARED) {
    WARN("no dpkg here, or no shared library");
    return;
  }
  const Folder folder;
  const fs::path packages = make_packages(folder);
  CHECK(files_below(packages).size() == kNames.size());
  const Root root(folder.path());
  std::string all;
  for (const std::string& name : kNames) {
    const std::string file = package_file(packages, name);
    CHECK(field(file, "Package") == name + "\n");
    CHECK(field(file, "Description").find('\n') != std::string::npos);
    all += " '" + file + "'";
  }
  const std::string development = package_file(packages, "libcradle-client-dev");
  const std::string version = field(development, "Version");
  CHECK_THAT(field(development, "Depends"),
             Catch::Matchers::Contains(
                 "libcradle-client0 (= " + version.substr(0, version.size() - 1) + ")"));
  CHECK_THAT(field(development, "Depends"), Catch::Matchers::Contains("liblcm-dev"));

  for (const std::string name : {"libcradle-client0", "cradled"}) {  // found in the binaries
    const std::string depends = field(package_file(packages, name), "Depends");
    CHECK_THAT(depends, Catch::Matchers::Contains("liblcm1"));
    CHECK_THAT(depends, Catch::Matchers::Contains("libc6 (>= "));
  }

  const Finished installed = root.dpkg("--install" + all);
  CAPTURE(installed.output, installed.errors);
  REQUIRE(installed.exit_code == 0);
  for (const std::string& name : kNames) {
    CHECK(root.state(name) == "installed");
    CHECK(fs::exists(root.path() / "usr/share/doc" / name / "copyright"));
  }
  CHECK(fs::exists(root.path() / "usr/share/man/man8/cradled.8.gz"));
  const bool has_config = fs::exists(CRADLE_SOURCE_DIR "/server/deploy/cradled.toml");
  CHECK(fs::exists(root.path() / "etc/cradle/cradled.toml") == has_config);

  {  // The installed daemon and tool, with the scene that comes with them.
    std::vector<std::string> arguments =
        serve_arguments({"--scene", (root.path() / "usr/share/cradle/demo.toml").string()});
    arguments[0] = (root.path() / "usr/sbin/cradled").string();
    Process daemon(arguments);
    const std::string status =
        type("'" + (root.path() / "usr/bin/cradle").string() + "' --timeout 20 --lcm-url '" +
             own_url() + "' --world test status");
    CHECK_THAT(status, Catch::Matchers::StartsWith("test: running"));
    daemon.signal(SIGTERM);
    CHECK(daemon.wait(10s).value_or(-1) == 0);
  }

  CHECK(root.dpkg("--remove libcradle-client0").exit_code != 0);  // the other needs it
  const Finished removed = root.dpkg("--remove cradled libcradle-client-dev libcradle-client0");
  CAPTURE(removed.output, removed.errors);
  CHECK(removed.exit_code == 0);
  // A configuration file that the administrator may have changed stays until the purge.
  CHECK(files_below(root.path()).size() == (has_config ? 1U : 0U));
  const Finished purged = root.dpkg("--purge cradled libcradle-client-dev libcradle-client0");
  CAPTURE(purged.output, purged.errors);
  CHECK(purged.exit_code == 0);
  CHECK(fs::is_empty(root.path()));
  for (const std::string& name : kNames) CHECK(root.state(name) != "installed");
}

}  // namespace cradle
