// The thread pool: every index once, whoever sleeps or comes late.
#include "server/thread_pool.h"

#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <set>

namespace cradle {
namespace {

/// Longer than threads stay awake.
void let_fall_asleep() { std::this_thread::sleep_for(std::chrono::milliseconds(2)); }

/// True if every index was met exactly once.
bool covers_all(ThreadPool& pool, int count, int least) {
  std::vector<int> hits(static_cast<std::size_t>(count), 0);
  pool.for_ranges(count, least, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) ++hits[static_cast<std::size_t>(i)];
  });
  return std::ranges::all_of(hits, [](int n) { return n == 1; });
}

/// How many threads take part in a call. None ends its first range before all have begun one.
std::size_t threads_in_a_call(ThreadPool& pool, int threads) {
  std::atomic<int> begun = 0;
  std::mutex mutex;
  std::set<std::thread::id> ids;
  pool.for_ranges(4 * threads, 1, [&](int, int) {
    ++begun;
    while (begun < threads) std::this_thread::yield();
    const std::lock_guard lock(mutex);
    ids.insert(std::this_thread::get_id());
  });
  return ids.size();
}

}  // namespace

TEST_CASE("a thread pool of any size covers every index exactly once, call after call") {
  for (const int threads : {1, 2, 3, 8, 100}) {
    ThreadPool pool(threads);
    for (int count = 0; count < 200; ++count) {
      CAPTURE(threads, count);
      CHECK(covers_all(pool, count, 1));
      CHECK(covers_all(pool, count, 7));
    }
  }
}

TEST_CASE("the threads of a pool work side by side, also after they have slept") {
  ThreadPool pool(3);
  for (int round = 0; round < 20; ++round) {
    CHECK(threads_in_a_call(pool, 3) == 3);
    if (round % 2 == 0) let_fall_asleep();
  }
}

TEST_CASE("threads get up when a shift begins, stay awake while it lasts, and sleep after it") {
  ThreadPool pool(3);
  const auto comes_to = [&](int sleeping) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (pool.sleeping() != sleeping && std::chrono::steady_clock::now() < end) let_fall_asleep();
    return pool.sleeping() == sleeping;
  };
  for (int round = 0; round < 5; ++round) {
    REQUIRE(comes_to(2));
    const Shift shift(pool);
    REQUIRE(comes_to(0));
    for (int k = 0; k < 5; ++k) {
      let_fall_asleep();
      CHECK(pool.sleeping() == 0);
    }
    CHECK(covers_all(pool, 100, 1));
  }
}

TEST_CASE("what is not worth a thread is done by the caller at once") {
  ThreadPool pool(4);
  int calls = 0;
  const auto caller = std::this_thread::get_id();
  pool.for_ranges(19, 10, [&](int begin, int end) {
    ++calls;
    CHECK(begin == 0);
    CHECK(end == 19);
    CHECK(std::this_thread::get_id() == caller);
  });
  CHECK(calls == 1);
}

TEST_CASE("nobody waits for a thread that is busy while there are ranges that nobody has taken") {
  // The first range ends after all others: whoever has it leaves its other ranges to the rest.
  ThreadPool pool(2);
  for (int round = 0; round < 100; ++round) {
    std::atomic<int> others = 0;
    pool.for_ranges(8, 1, [&](int begin, int) {
      if (begin != 0) {
        ++others;
        return;
      }
      while (others < 7) std::this_thread::yield();
    });
    CHECK(others == 7);
  }
}

TEST_CASE("ten thousand calls of a few ranges lose none, with pauses in which threads sleep") {
  ThreadPool pool(4);
  std::vector<int> sums(64, 0);
  constexpr int kCalls = 10'000;
  for (int call = 0; call < kCalls; ++call) {
    const int count = 1 + call % 64;
    for_each_index(pool, static_cast<std::size_t>(count), 1, [&](std::size_t i) { ++sums[i]; });
    if (call % 500 == 0) let_fall_asleep();
  }
  for (int i = 0; i < 64; ++i) {
    int expected = 0;
    for (int call = 0; call < kCalls; ++call) expected += call % 64 >= i ? 1 : 0;
    CHECK(sums[static_cast<std::size_t>(i)] == expected);
  }
}

TEST_CASE("a pool ends at once whether its threads sleep, wait awake or have just begun") {
  for (int round = 0; round < 200; ++round) {
    ThreadPool pool(3);
    if (round % 3 > 0) CHECK(covers_all(pool, 100, 1));
    if (round % 3 == 2 && round < 60) let_fall_asleep();
  }
}

TEST_CASE("sums in parts are the same on any number of threads") {
  std::vector<double> numbers(1000), sums;
  for (std::size_t k = 0; k < numbers.size(); ++k) numbers[k] = 1 / (1.0 + static_cast<double>(k));
  for (const int threads : {1, 2, 4}) {
    ThreadPool pool(threads);
    std::vector<double> parts(chunks_of(numbers.size(), 64), 0);
    for_chunks(pool, numbers.size(), 64, [&](std::size_t part, std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) parts[part] += numbers[k];
    });
    double sum = 0;
    for (const double part : parts) sum += part;
    sums.push_back(sum);
  }
  CHECK(sums[1] == sums[0]);
  CHECK(sums[2] == sums[0]);
}

}  // namespace cradle
