#pragma once
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <thread>

namespace porthos::test {

/// Wall-clock time of what `run` does [s].
template <class Run>
double seconds_of(Run run) {
  const auto started = std::chrono::steady_clock::now();
  run();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
}

/// Runs part(kills so far) in a child that is killed after a random time of up to `longest` [s],
/// again and again until there were `kills` of them or a child has come to its end, which must be a
/// good one. `killed`: how many were killed.
template <class Part>
void kill_at_random(int kills, double longest, Part part, int& killed) {
  for (killed = 0; killed < kills; ++killed) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      try {
        part(killed);
      } catch (const std::exception& e) {
        std::fprintf(stderr, "child: %s\n", e.what());
        _exit(1);
      }
      _exit(0);
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(longest * std::rand() / RAND_MAX));
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    if (WIFEXITED(status)) {
      ASSERT_EQ(WEXITSTATUS(status), 0);
      break;
    }
  }
}

}  // namespace porthos::test
