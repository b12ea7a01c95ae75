#pragma once
#include <pybind11/pybind11.h>

#include <atomic>
#include <functional>

namespace porthos::python {

/// How far something has come: fraction, wall seconds spent, wall seconds left.
struct Advance {
  std::atomic<double> fraction{-1}, spent{0}, left{0};
};

/// Does the work without the GIL on a thread of its own, while this one waits for it and, twenty
/// times a second, looks for signals. Ctrl-C sets the flag the work is given; when it has stopped,
/// KeyboardInterrupt is raised here. report: called with the GIL whenever `advance` has changed;
/// may be None.
void interruptibly(const std::function<void(const std::atomic<bool>& stop)>& work,
                   pybind11::object report = pybind11::none(), Advance* advance = nullptr);

}  // namespace porthos::python
