/// `cradle status`: the last heartbeat, for people or as JSON.
#pragma once

#include <cradle/world_view.h>

#include <string>

namespace cradle::tool {

std::string describe(const WorldStatus& status);

/// One object; the keys are the fields of world_status_v3.lcm, flags as booleans.
std::string to_json(const WorldStatus& status);

}  // namespace cradle::tool
