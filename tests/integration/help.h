/// What the help of a program lists, for tests of what must list the same.
#pragma once

#include <set>
#include <string>
#include <vector>

namespace cradle {

/// Of `program` in the build's bin folder.
std::vector<std::string> subcommands_of(const std::string& program);

/// The long options of a subcommand, like "--scene"; of the program itself if that is empty.
std::set<std::string> flags_of(const std::string& program, const std::string& subcommand = "");

}  // namespace cradle
