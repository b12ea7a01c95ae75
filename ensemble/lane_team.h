#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ensemble/batch.h"
#include "integrators/core/lane_integrator.h"

namespace porthos::ensemble {

/// The lanes of one thread, and their runs.
class LaneTeam {
 public:
  /// The model must outlive it. @throws InvalidArgument as make_integrator
  LaneTeam(const phs::Model& model, std::string method, double step, integrators::Options options,
           bool lanes = true);

  /// Works until the source is empty and every run has ended, or until stopped() returns true.
  void work(const Source& next, const std::function<bool()>& stopped);

  /// What the runs so far cost.
  struct Spent {
    std::int64_t iterations = 0;  ///< of an explicit method its steps
    std::int64_t alone = 0;       ///< runs that left their lane for an integrator of their own
  };
  /// Adds it to a sum.
  void add_spent(Spent& sum) const {
    sum.iterations += alone_.iterations + (lanes_ ? lanes_->rounds_of_lanes() : 0);
    sum.alone += alone_.alone;
  }

 private:
  using Lanes = integrators::LaneIntegrator::Lanes;

  /// Puts the next run into a lane. @return whether there was one
  bool fill(int lane, const Source& next);
  void check(const BatchRun& run) const;
  /// Continues a run with the integrator of one state, from `state` and the memory of a stuck lane
  /// (empty: from the start).
  void alone(BatchRun& run, phs::State state, std::span<const double> memory);
  void arrived(int lane);

  const phs::Model& model_;
  std::string method_;
  double step_;
  integrators::Options options_;
  size_t powers_;
  std::unique_ptr<integrators::LaneIntegrator> lanes_;  ///< null: one state at a time
  std::span<Lanes> parameters_;
  std::vector<double> given_;                   ///< the model's own parameters
  std::vector<std::unique_ptr<BatchRun>> run_;  ///< in each lane
  Spent alone_;                                 ///< of the runs without a lane
  phs::State state_;
  std::vector<double> port_work_;
  std::function<bool()> stopped_;
};

}  // namespace porthos::ensemble
