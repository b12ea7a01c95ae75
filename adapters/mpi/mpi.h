#pragma once
#include <optional>

#include "scene/ensemble/ensemble.h"

/// Ensembles over the ranks of MPI, for more than one machine.
namespace porthos::adapters {

/// This process among those mpirun has started; MPI is at work while it lives.
class MpiRank {
 public:
  /// @throws InvalidArgument if the MPI library lets only one thread use it
  MpiRank();
  ~MpiRank();
  MpiRank(const MpiRank&) = delete;
  MpiRank& operator=(const MpiRank&) = delete;

  int rank() const { return rank_; }
  int size() const { return size_; }
  /// From now on some rank will not answer: MPI is left without its farewell, which would wait for
  /// it.
  void lost_some() const { lost_ = true; }

 private:
  int rank_ = 0, size_ = 1;
  mutable bool lost_ = false;
};

/// scene::run_ensemble over all ranks. Rank 0 hands out cases a few at a time, keeps the log, runs
/// cases too, and writes the results: the same bytes as one process. A rank that has not been heard
/// of for ten seconds is given up and its cases are handed out again; where the MPI runtime ends
/// the others with it, the log has every case that was done and `resume` runs the rest.
/// @return the report on rank 0, nothing on the others. @throws InvalidArgument as
///   scene::run_ensemble
std::optional<scene::EnsembleReport> run_ensemble(const MpiRank& rank,
                                                  const scene::Ensemble& ensemble,
                                                  const scene::EnsembleOptions& options);

}  // namespace porthos::adapters
