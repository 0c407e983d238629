/// Where parallel work goes: the physics says what may run side by side, its caller where.
#pragma once

#include <functional>

namespace cradle {

class Executor {
 public:
  virtual ~Executor() = default;

  /// Calls `task(begin, end)` for ranges that cover 0 .. count once, in any order or side by side.
  /// Tasks may write only what belongs to their own indices: results do not depend on the split.
  virtual void for_ranges(int count, const std::function<void(int begin, int end)>& task) = 0;
};

/// All of it, here and now.
class SerialExecutor final : public Executor {
 public:
  void for_ranges(int count, const std::function<void(int, int)>& task) override {
    if (count > 0) task(0, count);
  }
};

}  // namespace cradle
