#pragma once
#include <pybind11/pybind11.h>

#include <atomic>
#include <functional>

namespace porthos::python {

/// The progress of some work: fraction, wall seconds spent, wall seconds left.
struct Advance {
  std::atomic<double> fraction{-1}, spent{0}, left{0};
};

/// Does the work without the GIL on a thread of its own. This thread waits for it and checks for
/// signals twenty times a second. Ctrl-C sets the flag that the work receives; when it has stopped,
/// KeyboardInterrupt is raised here. report: called with the GIL whenever `advance` has changed;
/// may be None.
void interruptibly(const std::function<void(const std::atomic<bool>& stop)>& work,
                   pybind11::object report = pybind11::none(), Advance* advance = nullptr);

/// A run's options with the stop flag and the progress of interruptibly().
template <class Options>
void attach(Options& o, const std::atomic<bool>& stop, Advance& advance) {
  o.stop = &stop;
  o.progress = [&](double fraction, double spent, double left) {
    advance.spent = spent;
    advance.left = left;
    advance.fraction = fraction;
  };
}

}  // namespace porthos::python
