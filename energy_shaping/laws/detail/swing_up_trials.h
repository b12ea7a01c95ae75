#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "energy_shaping/laws/joint_swing_up.h"

namespace porthos::energy_shaping {

/// Settings of a swing-up that are tried by runs of the mechanism, with the sampled laws and their
/// limits. A run costs what its instants and steps do, so their number is bounded.
class SwingUpTrials {
 public:
  /// @param upright  q*
  /// @param basin    with the laws that take over
  SwingUpTrials(std::shared_ptr<const JointSwingUp::Data> of, std::string actuator,
                std::vector<double> upright, SwingUpRun run, LevelSet basin, double leave)
      : of_(std::move(of)),
        actuator_(std::move(actuator)),
        upright_(std::move(upright)),
        run_(std::move(run)),
        basin_(std::move(basin)),
        leave_(leave) {}

  /// The first settings that hand over and hold, or what would help if none do, as the end of a
  /// sentence; empty: nothing could be tried. Some seconds at most
  std::string words();

 private:
  struct Settings {
    double bandwidth, pump;
    std::optional<double> margin;  ///< none: the law's own
    double level;
  };
  /// How a run differs from that of the user.
  struct Change {
    double start = 0;                           ///< added to each coordinate [rad | m]
    double longer = 1, faster = 1, limits = 1;  ///< factors of duration, rate and limit
  };
  struct Tried {
    double at = HUGE_VAL;  ///< first handover [s]
    bool stays = false;    ///< the second law acts at the end, within the level
  };
  Tried outcome(const Settings& s, const Change& change);
  bool works(const Settings& s, double& at);
  std::vector<double> bandwidths() const;
  std::vector<double> pumps() const;
  std::vector<double> levels() const;
  std::vector<Settings> all_settings(const std::vector<double>& at_bandwidths,
                                     const std::vector<double>& at_levels) const;
  std::string named(const Settings& s) const;
  std::string of_none(size_t tried, double level);

  std::shared_ptr<const JointSwingUp::Data> of_;
  std::string actuator_;
  std::vector<double> upright_;
  SwingUpRun run_;
  LevelSet basin_;
  double leave_;
  double work_ = 0;  ///< instants and steps so far
};

}  // namespace porthos::energy_shaping
