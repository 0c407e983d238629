/// The picture that `cradle watch` draws: who moves, where, how fast.
#pragma once

#include <cradle/client.h>

#include <deque>
#include <string>
#include <vector>

#include "text.h"

namespace cradle::tool {

/// Lines without their ends, at most Style::rows; `news` are the latest events, oldest first.
std::vector<std::string> draw(const Client& client, const std::deque<Event>& news,
                              const Style& style);

}  // namespace cradle::tool
