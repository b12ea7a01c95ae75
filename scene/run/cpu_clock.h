#pragma once
#include <ctime>

namespace porthos::scene {

/// Processor seconds of the calling thread.
inline double thread_cpu_now() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

}  // namespace porthos::scene
