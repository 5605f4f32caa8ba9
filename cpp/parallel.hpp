// Loops over threads, which take their items one after another. Work items never share output, so results do not depend
// on the number of threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>

namespace partwright {

// How many threads are meant: 0 is one a core.
int thread_count(int requested);

// As many of the threads as each have at least so much of the work: a call that is shorter than the way to another
// thread is done before that is awake.
inline int worth_their_while(int threads, int64_t work, int64_t least) {
  return int(std::clamp<int64_t>(work / least, 1, thread_count(threads)));
}

// Calls `run` in this thread, and at the same time in up to threads - 1 others, which stay from one call to the next.
// Those that come too late are not waited for, so `run` must do all that is left to do wherever it is called. Calls of
// several threads share the cores; of a call within a call the inner one mostly runs alone.
void together(int threads, const std::function<void()>& run);

// Calls work(item, state) for every item, each on one thread, in no particular order. Each thread makes a state of
// its own, once.
template <typename Make, typename Work>
void parallel_for(int64_t items, int threads, Make make, Work work) {
  std::atomic<int64_t> next{0};
  const auto run = [&] {
    int64_t i = next++;
    if (i >= items) return;
    auto state = make();
    for (; i < items; i = next++) work(i, state);
  };
  threads = int(std::min<int64_t>(thread_count(threads), items));
  if (threads > 1)
    together(threads, run);
  else
    run();
}

// The same for work without a state.
template <typename Work>
void parallel_for(int64_t items, int threads, Work work) {
  parallel_for(items, threads, [] { return 0; }, [&](int64_t i, int) { work(i); });
}

}  // namespace partwright
