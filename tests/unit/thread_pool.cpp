// The thread pool: every index once, results that do not depend on the number of threads.
#include "server/thread_pool.h"

#include <atomic>
#include <catch2/catch.hpp>
#include <set>

namespace cradle {

TEST_CASE("a thread pool of any size covers every index exactly once, call after call") {
  for (const int threads : {1, 2, 3, 8}) {
    ThreadPool pool(threads);
    for (int count = 0; count < 200; ++count) {
      std::vector<int> hits(static_cast<std::size_t>(count), 0);
      pool.for_ranges(count, [&](int begin, int end) {
        for (int i = begin; i < end; ++i) ++hits[static_cast<std::size_t>(i)];
      });
      CAPTURE(threads, count);
      CHECK(std::all_of(hits.begin(), hits.end(), [](int n) { return n == 1; }));
    }
  }
}

TEST_CASE("the threads of a pool work side by side") {
  ThreadPool pool(3);
  // Each of the first three ranges waits until all three have begun: they do only if no thread has
  // to finish one range before another begins.
  std::atomic<int> begun = 0;
  std::mutex mutex;
  std::set<std::thread::id> ids;
  pool.for_ranges(12, [&](int, int) {
    ++begun;
    while (begun < 3) std::this_thread::yield();
    const std::lock_guard lock(mutex);
    ids.insert(std::this_thread::get_id());
  });
  CHECK(ids.size() == 3);
}

}  // namespace cradle
