#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mechanics/hamiltonian_field.h"
#include "scene/run/record_log.h"

namespace porthos::scene {

struct Assembly;
struct RunReport;

/// Joints that swing between two records: the way from one record to the next is not the one that
/// the rates at both give. Pictures of such records mislead: a fast swing may look slow.
class FastSwings {
 public:
  /// Of joints of one freedom. The assembly must outlive it.
  FastSwings(const Assembly& assembly, const RecordLayout& layout);
  bool any() const { return !joints_.empty(); }
  /// Adds a record, a row of the layout. Of many only the first 4000 are looked at: each takes an
  /// evaluation of the rates, O(n).
  void see(std::span<const double> record);
  /// Adds one note that names the joints.
  void fill(RunReport& report) const;

 private:
  struct Joint {
    std::string name;
    size_t q, v;
    std::optional<size_t> turn;     ///< none: a slide
    double position = 0, rate = 0;  ///< at the record before
    double path = 0, off = 0;       ///< sums of h |v|, and of |Δq - h v|
    bool swings() const;
  };
  const Assembly& assembly_;
  RecordLayout layout_;
  std::vector<Joint> joints_;
  std::vector<std::int64_t> turns_;
  std::optional<mechanics::Workspace<double>> workspace_;
  int seen_ = 0;
  double before_ = 0, apart_ = 0;  ///< time of the last record, the longest between two [s]
};

}  // namespace porthos::scene
