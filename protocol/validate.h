/// Checks what the numbers of a command mean, without a world: the same checks in the client
/// library, before sending, and in the server, before applying. All rules are those of limits.h.
#pragma once

#include "protocol/command.h"

namespace cradle {

Result validate(const BodySpec& spec);
Result validate(const Wrench& wrench);
Result validate(const Motion& motion);
Result validate_gravity(const Vec3& gravity_W);

/// The whole command: the first fault, and the item it is in.
Outcome validate(const CommandBody& body);

/// UTF-8 without control characters, at most `max_bytes` long.
bool is_name(std::string_view name, int max_bytes);

}  // namespace cradle
