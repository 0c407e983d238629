/// A configuration file for tests.
#pragma once

#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <string>

#include "server/config_layers.h"

namespace cradle {

/// In a folder of its own, for as long as the object lives.
class ConfigFile {
 public:
  explicit ConfigFile(const std::string& text) {
    std::string folder = (std::filesystem::temp_directory_path() / "cradle-XXXXXX").string();
    REQUIRE(::mkdtemp(folder.data()));
    folder_ = folder;
    std::ofstream(path()) << text;
  }
  ~ConfigFile() { std::filesystem::remove_all(folder_); }
  ConfigFile(const ConfigFile&) = delete;
  ConfigFile& operator=(const ConfigFile&) = delete;

  std::filesystem::path folder() const { return folder_; }
  std::string path() const { return (folder_ / "cradled.toml").string(); }

 private:
  std::filesystem::path folder_;
};

}  // namespace cradle
