/// Work in a process of its own: whatever happens there, this one goes on.
#pragma once

#include <functional>
#include <string>

namespace cradle::bench {

struct ChildResult {
  bool is_done = false;
  std::string text;  ///< what `work` returned; else why there is nothing
};

/// Forks. Not done are: an exception ("failed: ..." with its words), a signal ("crashed: ..."), an
/// exit that nobody asked for, and more than `limit_s` of wall time, after which the child is
/// killed. No other thread may run.
ChildResult in_child(const std::function<std::string()>& work, double limit_s = 600);

}  // namespace cradle::bench
