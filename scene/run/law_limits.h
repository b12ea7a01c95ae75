#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "scene/run/record_log.h"

namespace porthos::scene {

struct Assembly;
struct RunReport;

/// How often the laws of controllers are hindered, from the records of a run: at their limits, or
/// not defined. What a certificate says of a law does not hold there.
class LawLimits {
 public:
  /// The assembly must outlive it.
  LawLimits(const Assembly& assembly, const RecordLayout& layout);
  bool any() const { return !laws_.empty(); }
  /// Adds a record, a row of the layout: an evaluation of each law.
  void see(std::span<const double> record);
  /// Adds a note for each law that was hindered.
  void fill(RunReport& report) const;

 private:
  struct Count {
    std::int64_t records = 0;
    double first = 0;  ///< time of the first of them [s]
    void add(double time);
  };
  struct Watched {
    Count limit, hindrance;
    const char* why = nullptr;
  };
  void note(RunReport& report, const std::string& law, const Count& count,
            const std::string& what) const;

  const Assembly& assembly_;
  RecordLayout layout_;
  std::vector<Watched> laws_;  ///< as the assembly's
  std::vector<size_t> angles_;
  std::vector<std::int64_t> turns_;
  std::vector<double> x_;
  std::int64_t records_ = 0;
};

}  // namespace porthos::scene
