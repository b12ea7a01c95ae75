#include "python/interruptible.h"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

namespace porthos::python {

namespace py = pybind11;

void interruptibly(const std::function<void(const std::atomic<bool>& stop)>& work,
                   py::object report, Advance* advance) {
  using namespace std::chrono_literals;
  std::atomic<bool> stop{false};
  std::mutex mutex;
  std::condition_variable done;
  bool finished = false;
  std::exception_ptr failure, interruption;
  std::thread worker([&] {
    try {
      // One thread state for all callbacks of this run: without it each callback would make its
      // own.
      const py::gil_scoped_acquire known;
      const py::gil_scoped_release released;
      work(stop);
    } catch (...) {
      failure = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    finished = true;
    done.notify_one();
  });
  double reported = -1;
  const auto attend = [&] {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (!advance || report.is_none()) return;
    const double f = advance->fraction;
    if (f != reported) {
      reported = f;
      report(f, advance->spent.load(), advance->left.load());
    }
  };
  for (;;) {
    {
      const py::gil_scoped_release released;
      std::unique_lock lock(mutex);
      if (done.wait_for(lock, 50ms, [&] { return finished; })) break;
    }
    if (interruption) continue;  // it is stopping
    try {
      attend();
    } catch (...) {
      interruption = std::current_exception();
      stop = true;
    }
  }
  {
    const py::gil_scoped_release released;
    worker.join();
  }
  if (interruption) {
    failure = nullptr;
    std::rethrow_exception(interruption);
  }
  if (failure) std::rethrow_exception(failure);
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

}  // namespace porthos::python
