#pragma once
#include <string>

#include "mechanics/builder.h"

namespace porthos::mechanics {

/// A flexible panel or boom: a beam of constant section that bends in one plane, as rigid segments
/// on sprung hinges.
///
/// The panel's frame is at its root on a link: x along the panel, y the bending axis (along its
/// width), z its normal. The beam is cut into N pieces of length l = L/N, with a hinge of stiffness
/// EI/l in the middle of each. The rigid segments thus have lengths l/2 (fixed to the link), l … l,
/// l/2. The n-th bending frequency is that of the clamped Euler-Bernoulli beam to order 2 in 1/N:
/// ω_n = λ_n² √(EI/(ρA L⁴)), λ = 1.8751, 4.6941, 7.8548. Source: the segments are the rigid finite
/// elements of Kruszewski (in Wittbrodt, Adamiec-Wójcik, Wojciech 2006).
struct Panel {
  std::string name;                                ///< hinges are "<name>_1" … "<name>_N"
  std::string link;                                ///< the link it is clamped to
  Pose root{Mat3<double>::identity(), {0, 0, 0}};  ///< its frame, in the link's frame
  double length = 0;                               ///< L [m]
  double width = 0;                                ///< [m], 0: a thin boom
  double mass = 0;                                 ///< [kg]
  double bending_stiffness = 0;                    ///< EI [N m²]
  int segments = 8;                                ///< N
  double damping_ratio = 0;  ///< of the first bending mode; damping is proportional to stiffness
  std::string where;         ///< "file:line" for messages, may be empty
};

/// Frequency of the n-th bending mode (1, 2 or 3) of the clamped beam [rad/s].
double bending_frequency(const Panel& p, int n);

/// Adds the segments of the panel to a mechanism.
/// @throws InvalidArgument naming the panel: lengths, mass or stiffness that are not positive, no
///   segment
void add_panel(MechanismBuilder& b, const Panel& p);

}  // namespace porthos::mechanics
