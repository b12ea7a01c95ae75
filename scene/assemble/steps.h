#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "scene/read/scene.h"

namespace porthos::scene {

/// The steps of a run: whole ones of the scene's size and, where they do not add up to the
/// duration, a shorter last one. The end time asked for is the end time.
struct Steps {
  double size = 0;         ///< [s]
  double duration = 0;     ///< [s]
  std::int64_t total = 0;  ///< with the shorter one
  double last = 0;         ///< [s] of a shorter last step; 0: all are whole
  std::int64_t every = 1;  ///< from record to record

  /// Whether the step after so many is the shorter one.
  bool ends_short(std::int64_t taken) const { return last > 0 && taken + 1 == total; }
  /// The time after so many [s].
  double time(std::int64_t taken) const {
    return last > 0 && taken == total ? duration : double(taken) * size;
  }
  /// Whether a record at the usual distance is due after so many.
  bool at_record(std::int64_t taken) const {
    return taken % every == 0 && !(last > 0 && taken == total);
  }
};
/// The steps of a scene's run.
Steps steps_of(const Scene& scene);

/// The longest step up to `longest` that is a whole fraction of the time between records, where
/// that is stated, no shorter and itself a whole fraction of the duration; else of the duration. It
/// goes into the times of events and switches and into the periods of sampled controllers too.
double fitting_step(const Scene& scene, double longest);

/// What a reader of the results should know of how the scene's numbers were taken: a last step of
/// another size, records at other times, keys that had no effect. sweeps: of the implicit
/// equations, 0 where there were none.
std::vector<std::string> notes_on_numbers(const Scene& scene, std::int64_t sweeps);

}  // namespace porthos::scene
