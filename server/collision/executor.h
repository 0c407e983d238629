/// Where parallel work goes: the physics says what may run side by side, its caller where.
#pragma once

#include <algorithm>
#include <cstddef>

namespace cradle {

/// What is to be done for indices begin .. end. Refers to a callable that outlives the call, and
/// asks for no memory: a tick makes hundreds.
class RangeTask {
 public:
  template <class F>
  RangeTask(const F& callable)  // NOLINT: lambdas are to be handed over as they are
      : callable_(&callable),
        call_([](const void* f, int begin, int end) { (*static_cast<const F*>(f))(begin, end); }) {}

  void operator()(int begin, int end) const { call_(callable_, begin, end); }

 private:
  const void* callable_;
  void (*call_)(const void*, int, int);
};

class Executor {
 public:
  virtual ~Executor() = default;

  /// Calls `task(begin, end)` for ranges that cover 0 .. count once, in any order or side by side.
  /// Tasks may write only what belongs to their own indices: results do not depend on the split.
  /// Fewer than `least` indices are not worth a thread: a microsecond's work.
  virtual void for_ranges(int count, int least, RangeTask task) = 0;

  /// How many ranges may be under way at a time: what takes more work in parts asks whether parts
  /// are worth it. Results do not depend on it.
  virtual int threads() const { return 1; }

  /// From here on until `end_shift` work may come at any time: threads that sleep are to get up
  /// meanwhile, and to stay awake.
  virtual void begin_shift() {}
  virtual void end_shift() {}
};

/// A shift while it lives.
class Shift {
 public:
  explicit Shift(Executor& executor) : executor_(executor) { executor_.begin_shift(); }
  ~Shift() { executor_.end_shift(); }
  Shift(const Shift&) = delete;
  Shift& operator=(const Shift&) = delete;

 private:
  Executor& executor_;
};

/// All of it, here and now.
class SerialExecutor final : public Executor {
 public:
  void for_ranges(int count, int, RangeTask task) override {
    if (count > 0) task(0, count);
  }
};

/// For whoever is not told where.
inline SerialExecutor serial_executor;

/// Calls `f(k)` for k of 0 .. count.
template <class F>
void for_each_index(Executor& executor, std::size_t count, int least, const F& f) {
  executor.for_ranges(static_cast<int>(count), least, [&f](int begin, int end) {
    for (int k = begin; k < end; ++k) f(static_cast<std::size_t>(k));
  });
}

inline std::size_t chunks_of(std::size_t count, std::size_t size) {
  return (count + size - 1) / size;
}

/// Calls `f(chunk, begin, end)` for parts of `size` indices each, but the last: for sums, which are
/// to be made in an order that does not depend on threads.
template <class F>
void for_chunks(Executor& executor, std::size_t count, std::size_t size, const F& f) {
  for_each_index(executor, chunks_of(count, size), 1, [&](std::size_t chunk) {
    f(chunk, chunk * size, std::min(count, (chunk + 1) * size));
  });
}

}  // namespace cradle
