#pragma once
#include <span>
#include <vector>

#include "contact/contact.h"
#include "mechanics/spatial.h"

namespace porthos::contact {

/// What a soft contact does, all its points together.
struct SoftTouch {
  double depth = 0;  ///< the largest of its points, 0: none overlap [m]
  /// There, half of the least extent of the smaller shape; at most the sum of the radii where edges
  /// touch [m].
  double half_size = 0;
  double energy = 0;                ///< stored [J]
  double pressed = 0;               ///< the sum of the normal forces [N], never negative
  mechanics::Vec3d force{0, 0, 0};  ///< on the surfaces of Contact::a, friction included, world [N]
};

/// The soft contacts of a model at states. Not thread-safe; the model must outlive it.
class SoftTouches {
 public:
  explicit SoftTouches(const ContactModel& model);
  SoftTouches(SoftTouches&&) noexcept;
  ~SoftTouches();
  /// Of each of ContactModel::contacts(), valid until the next call. Cost: O(bodies + pairs), no
  /// allocation.
  std::span<const SoftTouch> at(const phs::State& state);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace porthos::contact
