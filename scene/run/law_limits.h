#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "phs/functions/law.h"
#include "scene/run/record_log.h"

namespace porthos::scene {

struct Assembly;
struct RunReport;

/// How often the laws of controllers are hindered, from the records of a run: at their limits, or
/// not defined. What a certificate says of a law does not hold there.
class LawLimits {
 public:
  /// Of the controllers of a scene, and of those of a network that is a model of the user's own.
  LawLimits(const Assembly& assembly, const RecordLayout& layout);
  bool any() const { return !laws_.empty(); }
  /// Adds a record, a row of the layout: an evaluation of each law.
  void see(std::span<const double> record);
  /// Adds a note for each law that was hindered. If the run failed in a state that a law is not
  /// meant for, and the law had been at its limit, the trouble also names that limit.
  void fill(RunReport& report) const;

 private:
  struct Count {
    std::int64_t records = 0;
    double first = 0;  ///< time of the first of them [s]
    void add(double time);
  };
  struct Watched {
    std::string name;  ///< "controller 'swing' at elbow.torque"
    phs::LawPtr law;
    double most;  ///< its limit
    std::function<const char*(std::span<const double>)> hindered;
    size_t at, size;  ///< of the state that it sees
    Count limit, hindrance;
    const char* why = nullptr;
  };
  std::span<const double> seen_by(const Watched& w) const {
    return std::span(x_).subspan(w.at, w.size);
  }
  std::string share(const Count& count) const;
  void note(RunReport& report, const std::string& law, const Count& count,
            const std::string& what) const;

  RecordLayout layout_;
  std::vector<Watched> laws_;
  std::vector<size_t> angles_;
  std::vector<std::int64_t> turns_;
  std::vector<double> x_;  ///< of the last record
  std::int64_t records_ = 0;
};

}  // namespace porthos::scene
