#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

/// What lets a sampled controller act, or not.
namespace porthos::phs {

/// Opens and closes a sampled controller at its sampling instants: one law hands over to another.
/// It remembers some numbers. They are part of the controller's hold, so they belong to a run and
/// to its checkpoint. The gate itself is immutable and shared between threads.
class Gate {
 public:
  virtual ~Gate() = default;
  /// What it remembers before the first instant.
  virtual std::vector<double> fresh() const = 0;
  /// Renews that at a sampling instant, before the law. x: state of the controlled system, with its
  /// angles unwrapped; memory: as many numbers as fresh(), changed
  virtual void renew(double t, std::span<const double> x, std::span<double> memory) const = 0;
  /// Whether the law acts until the next instant; if not, its value is 0. memory: of renew()
  virtual bool open(std::span<const double> memory) const = 0;
  /// Whether the change that the run waits for has not happened yet, such as that the second law
  /// acts. memory: of renew()
  virtual bool waits(std::span<const double> memory) const = 0;
  /// What happened after the time `since` [s], in a sentence; empty: nothing. memory: of renew()
  virtual std::string story(std::span<const double> memory, double since) const = 0;
};
using GatePtr = std::shared_ptr<const Gate>;

}  // namespace porthos::phs
