// Ranges are bits of one word: a thread takes one by clearing its bit, whatever call it is of. So
// one that comes late finds nothing, and one that does not come at all is not waited for: the
// others take its ranges. First each takes those that are its own in every call, so that what it
// has worked on lies in its cache.
#include "server/thread_pool.h"

#include <algorithm>
#include <bit>
#include <cassert>

#include "server/stopwatch.h"

namespace cradle {
namespace {

/// More than one, so that a thread which gets heavy indices does not keep the others waiting.
constexpr int kRangesPerThread = 8;
constexpr int kRangesMax = 64;

/// Threads come one after the other out of a call within less than this; who waits for longer lets
/// others have the processor, if there are more threads than processors.
constexpr double kSpin_us = 20;
/// Ticks that follow one another at once are no farther apart, but those in real time are.
constexpr double kAwake_us = 200;
/// A look at the clock costs as much as a pause.
constexpr int kPausesALook = 16;

void pause() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

/// False: it has not come true within `most_us`.
template <class Condition>
bool wait_awake(double most_us, const Condition& is_true) {
  for (int k = 0; k < kPausesALook; ++k) {
    if (is_true()) return true;
    pause();
  }
  const Stopwatch stopwatch;
  for (double us = 0; us < most_us; us = stopwatch.elapsed_us()) {
    for (int k = 0; k < kPausesALook; ++k) {
      if (is_true()) return true;
      pause();
    }
    if (us > kSpin_us) std::this_thread::yield();
  }
  return is_true();
}

}  // namespace

ThreadPool::ThreadPool(int threads) : threads_(threads) {
  assert(threads >= 1 && threads <= kThreadsMax);
  for (int i = 1; i < threads; ++i) workers_.emplace_back([this, i] { serve(i); });
}

ThreadPool::~ThreadPool() {
  is_ending_ = true;
  wake_sleepers();
  for (std::thread& worker : workers_) worker.join();
}

/// As many for each thread, if there are enough.
int ThreadPool::ranges_for(int count, int least) const {
  const int most = std::min(kRangesMax, kRangesPerThread * threads_);
  const int ranges = std::clamp(count / least, 1, most);
  return ranges > threads_ ? ranges - ranges % threads_ : ranges;
}

ThreadPool::Ranges ThreadPool::own_ranges(int thread) const {
  Ranges own = 0;
  for (int range = thread; range < kRangesMax; range += threads_) own |= Ranges{1} << range;
  return own;
}

/// A thread's own ranges lie side by side: what they touch, neighbours touch, too.
int ThreadPool::place_of(int range) const {
  const int each = ranges_ / threads_;
  return each == 0 ? range : range % threads_ * each + range / threads_;
}

void ThreadPool::for_ranges(int count, int least, RangeTask task) {
  if (count <= 0) return;
  const int ranges = ranges_for(count, least);
  if (ranges == 1 || threads_ == 1) return task(0, count);
  task_ = &task;
  count_ = count;
  ranges_ = ranges;
  unfinished_.store(ranges, std::memory_order_relaxed);
  open_.store(~Ranges{0} >> (kRangesMax - ranges));
  if (sleepers_.load() > 0) wake_sleepers();
  take_ranges(own_ranges(0));
  const auto is_done = [this] { return unfinished_.load(std::memory_order_acquire) == 0; };
  while (!wait_awake(kAwake_us, is_done)) {
  }
}

void ThreadPool::begin_shift() {
  is_shift_.store(true);
  if (sleepers_.load() > 0) wake_sleepers();
}

void ThreadPool::take_ranges(Ranges own) noexcept {
  int finished = 0;
  for (Ranges open = open_.load(std::memory_order_relaxed); open != 0;) {
    const int range = std::countr_zero((open & own) != 0 ? open & own : open);
    const Ranges bit = Ranges{1} << range;
    open = open_.fetch_and(~bit, std::memory_order_acq_rel);
    if ((open & bit) == 0) continue;  // somebody was faster
    const int place = place_of(range);
    const auto at = [this](std::int64_t k) { return static_cast<int>(k * count_ / ranges_); };
    (*task_)(at(place), at(place + 1));
    ++finished;
    open = open_.load(std::memory_order_relaxed);
  }
  if (finished > 0) unfinished_.fetch_sub(finished, std::memory_order_release);
}

void ThreadPool::serve(int thread) {
  const Ranges own = own_ranges(thread);
  while (wait_for_work()) take_ranges(own);
}

/// False: there will be none.
bool ThreadPool::wait_for_work() {
  const auto is_due = [this] { return open_.load() != 0 || is_ending_.load(); };
  while (!wait_awake(kAwake_us, is_due)) {
    if (!is_shift_.load()) sleep();
  }
  return !is_ending_.load();
}

/// Whoever opens ranges, or a shift, looks for sleepers afterwards, and this one for both after it
/// has said that it sleeps: one of both sees the other.
void ThreadPool::sleep() {
  std::unique_lock lock(mutex_);
  ++sleepers_;
  work_.wait(lock, [this] { return open_.load() != 0 || is_shift_.load() || is_ending_.load(); });
  --sleepers_;
}

void ThreadPool::wake_sleepers() {
  { const std::lock_guard lock(mutex_); }
  work_.notify_all();
}

}  // namespace cradle
