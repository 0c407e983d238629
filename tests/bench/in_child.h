/// Work in a process of its own: whatever happens there, this one goes on.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace cradle::bench {

struct ChildResult {
  bool is_done = false;
  std::string text;  ///< what the work returned; else why there is nothing
};

/// Called within a child's work: it waits while each of the others has a turn.
using PassOn = std::function<void()>;
/// Of a child. Called with what ends its turn.
using ChildWork = std::function<std::string(const PassOn&)>;

/// Forks a child for each of `works`, of which one runs at a time, in turns. Not done are: an
/// exception ("failed: ..." with its words), a signal ("crashed: ..."), an exit that nobody asked
/// for, and more than `limit_s` of wall time in its own turns, after which that child is killed. No
/// other thread may run. Children end with this process.
std::vector<ChildResult> in_children(const std::vector<ChildWork>& works, double limit_s = 600);
/// Likewise, of one.
ChildResult in_child(const std::function<std::string()>& work, double limit_s = 600);

}  // namespace cradle::bench
