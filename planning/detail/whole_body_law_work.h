#pragma once
#include <mutex>

#include "planning/whole_body_law.h"

/// What WholeBodyLaw keeps. Private to whole_body_law.cpp and whole_body_steering.cpp.
namespace porthos::planning {

struct WholeBodyLaw::Work {
  // The memory: these counts, all but the first with the time of the first of them, then four
  // numbers for each task, then the force on each support, then what the gait remembers.
  enum Told { instants, gave_way, unkept = 3, unpaid = 5, told_size = 7 };
  enum OfTask { error_now, error_worst, error_when, missed, of_task };

  std::shared_ptr<const mechanics::MechanicalModel> model;
  WholeBodyDesign d;
  std::vector<std::string> motors;
  std::vector<int> freedoms;  ///< of the motors, in v
  std::mutex mutex;           ///< of what follows
  std::unique_ptr<WholeBody> body;
  size_t contacts = 0;
  std::vector<double> v_dot;
  std::vector<TaskLevel> levels, calm_levels;
  // With a gait, at an instant:
  Gait::Seen seen;
  Gait::Plan plan;

  TaskLevel task(const SteeredTask& s, double t, std::span<const double> q,
                 std::span<const double> v);
  /// While calm tasks do not pull, they only brake what moves.
  bool calm = false;
  template <class V>
  V asked(const V& wanted, double bandwidth, const V& moving) const {
    return calm ? V(-2 * bandwidth * moving) : wanted;
  }
  std::vector<TaskLevel> all_tasks(double t, std::span<const double> q, std::span<const double> v);
  TaskLevel points(const SteeredTask& s, double t);
  TaskLevel swing(const SteeredTask& s);
  bool near(const ContactPoint& p, const mechanics::Vec3d& at) const;
  void step(double t, std::span<double> memory);
  void touch(double t);
  void give_way();
  /// Where what the gait remembers begins in the memory.
  size_t told() const { return told_size + of_task * d.tasks.size() + 3 * d.supports.size(); }
  void tell(const WholeBodySolution& s, size_t before, double t, std::span<double> memory) const;
};

}  // namespace porthos::planning
