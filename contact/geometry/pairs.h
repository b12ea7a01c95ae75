#pragma once
#include <span>
#include <string>

#include "contact/geometry/shape.h"

/// Distances between shapes in closed form, in every scalar.
namespace porthos::contact {

/// Where two shapes A and B are nearest, in world axes.
template <class T>
struct Touch {
  T gap;       ///< signed distance [m]; negative: they overlap by that depth
  Vec3<T> n;   ///< unit, from A to B
  Vec3<T> at;  ///< halfway between the nearest points, from the origin of A's frame [m]
};

/// Frames of the two shapes in the world: their axes, and from A's origin to B's. Only the
/// difference of the origins enters, so a pair far from the world's origin keeps its digits.
template <class T>
struct Frames {
  Mat3<T> A, B;
  Vec3<T> d;
};

/// What the gaps are for.
enum class Ends {
  fade,  ///< energies: overlaps of edges are continuous, see touches()
  off    ///< rows of rigid contacts: a metre is added to the gap of two edges where they do not
         ///< cross, so there is one gap for each place; a cylinder may stand flat
};
/// Points at which two kinds can touch at the same time, each with a gap of its own (a box on a
/// plane: its 8 corners). 0: there is no closed form for this pair.
int points(Kind a, Kind b, Ends ends);
/// At most this many.
inline constexpr int most_points = 160;

/// Whether edges of these two kinds have gaps. They touch where their edges are round.
bool have_edges(Kind a, Kind b);

/// The pairs that exist, as text for messages: "plane and sphere, ...".
std::string known_pairs();

/// Gaps, normals and places of two shapes; `out` has points(a.kind, b.kind, ends) elements.
///
/// The gap is the exact distance outside and the depth of the nearest surface inside, and its
/// derivative along a motion is n · (v_B - v_A) at `at`. Exceptions, where the nearest point jumps:
/// centres of balls that coincide, parallel axes of two capsules, points deep inside a box or a
/// cylinder on its medial surface, and a cylinder that stands flat on a plane.
///
/// A box and a box or capsule have a gap for each corner of one (end of the capsule) and the other
/// as a whole, then one for each two edges. The least of them is the distance while their cores,
/// within the radii, are apart. Cost: about 60 operations for each point.
template <class T>
void touches(const Shape& a, const Shape& b, const Frames<T>& at, std::span<Touch<T>> out,
             Ends ends = Ends::fade);

#define PORTHOS_EXTERN(T)                                                       \
  extern template void touches<T>(const Shape&, const Shape&, const Frames<T>&, \
                                  std::span<Touch<T>>, Ends);
PORTHOS_FOR_EACH_SCALAR(PORTHOS_EXTERN)
#undef PORTHOS_EXTERN

}  // namespace porthos::contact
