#pragma once
#include <map>
#include <string>

#include "scene/run/run_report.h"

/// Notes on the whole of a run, whose limits are those of the whole and not of one phase.
namespace porthos::scene {

/// Controllers are noted that have given more than this part of the energy exchanged.
inline constexpr double least_delivered = 1e-6;
/// Newton's method is noted if it has factorised a matrix in more than this part of the steps.
inline constexpr double least_newton = 0.1;

/// The note on controllers that have delivered net energy (RunReport::delivered).
void note_delivered(RunReport& report);
/// The note on equations that Newton's method solved, with the method's remark, where its
/// cost matters or the run ended early.
void note_newton(RunReport& report, const std::string& remark);

/// The notes of the phases of a run: each kind once, with the start of the first phase that has it.
class PhaseNotes {
 public:
  /// @param from  when the phase began [s]
  void add(RunReport& whole, const RunReport& phase, double from);
  /// Adds the notes on the whole, after the last phase.
  void finish(RunReport& whole);

 private:
  struct Told {
    size_t at = 0;  ///< among the notes of the whole
    std::string text;
    int others = 0;  ///< of the same kind with other numbers
  };
  std::map<std::string, Told> told_;  ///< by kind
  std::string newton_;                ///< the first note on Newton's method
};

}  // namespace porthos::scene
