#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "scene/read/scene.h"

namespace porthos::scene {

/// The steps of a run: whole steps of the scene's size and, if the duration is no whole number of
/// them, a shorter last one. The run ends exactly at the requested time.
struct Steps {
  double size = 0;         ///< [s]
  double duration = 0;     ///< [s]
  std::int64_t total = 0;  ///< including the shorter one
  double last = 0;         ///< [s] of a shorter last step; 0: all are whole
  std::int64_t every = 1;  ///< steps from record to record

  std::int64_t whole() const { return total - (last > 0 ? 1 : 0); }  ///< steps of that size
  /// Whether the step after `taken` steps is the shorter one.
  bool ends_short(std::int64_t taken) const { return last > 0 && taken + 1 == total; }
  /// The time after `taken` steps [s].
  double time(std::int64_t taken) const {
    return last > 0 && taken == total ? duration : double(taken) * size;
  }
  /// Whether a regular record is due after `taken` steps.
  bool at_record(std::int64_t taken) const {
    return taken % every == 0 && !(last > 0 && taken == total);
  }
};
/// The steps of a scene's run.
Steps steps_of(const Scene& scene);

/// The longest step up to `longest` that is a whole fraction of the time between records, if that
/// time is stated, not shorter, and itself a whole fraction of the duration; otherwise a whole
/// fraction of the duration. The times of events and switches and the periods of sampled
/// controllers are whole multiples of the step too.
double fitting_step(const Scene& scene, double longest);

/// Notes for the reader of the results on how the scene's numbers were used: a last step of another
/// size, records at other times, keys that had no effect. sweeps: of the implicit equations, 0 if
/// there were none.
std::vector<std::string> notes_on_numbers(const Scene& scene, std::int64_t sweeps);

}  // namespace porthos::scene
