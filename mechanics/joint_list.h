#pragma once
#include <string>
#include <utility>
#include <vector>

#include "mechanics/joints/chains.h"
#include "mechanics/joints/cylindrical.h"
#include "mechanics/joints/free.h"
#include "mechanics/joints/helical.h"
#include "mechanics/joints/prismatic.h"
#include "mechanics/joints/revolute.h"
#include "mechanics/joints/spherical.h"

/// The joint lists. One line adds a joint type to the builder, the kernels, the URDF reader and
/// every test.
namespace porthos::mechanics {

/// A list of types as a value.
template <class... J>
struct TypeList {
  static constexpr int size = sizeof...(J);
};

using PrimitiveJoints = TypeList<Revolute,     //
                                 Prismatic,    //
                                 Helical,      //
                                 Cylindrical,  //
                                 Spherical,    //
                                 Free>;

using ChainJoints = TypeList<Continuous,  //
                             Universal,   //
                             Planar,      //
                             Fixed>;

/// Calls f(J{}) with the primitive joint at index `type` of the list.
template <class F, class... J>
[[gnu::always_inline]] inline void visit_joint(int type, TypeList<J...>, F&& f) {
  int i = 0;
  (void)((i++ == type && (f(J{}), true)) || ...);
}
template <class F>
[[gnu::always_inline]] inline void visit_joint(int type, F&& f) {
  visit_joint(type, PrimitiveJoints{}, static_cast<F&&>(f));
}

/// Calls f(J{}) for every joint of a list.
template <class F, class... J>
void for_each_joint(TypeList<J...>, F&& f) {
  (f(J{}), ...);
}

/// Names of all joint types that a user can choose.
inline std::vector<std::string> joint_type_names() {
  std::vector<std::string> names;
  const auto add = [&](auto j) { names.emplace_back(decltype(j)::name); };
  for_each_joint(PrimitiveJoints{}, add);
  for_each_joint(ChainJoints{}, add);
  return names;
}

/// Degrees of freedom of a joint type, from the joint lists; -1 for an unknown type.
inline int freedoms(std::string_view type) {
  int n = -1;
  for_each_joint(PrimitiveJoints{}, [&](auto J) {
    if (decltype(J)::name == type) n = decltype(J)::nv;
  });
  for_each_joint(ChainJoints{}, [&](auto J) {
    if (decltype(J)::name != type) return;
    n = 0;
    for (const ChainLink& link : decltype(J)::chain) n += freedoms(link.primitive);
  });
  return n;
}

/// f(constant k) for k = 0 … n-1, unrolled; `descending` for n-1 … 0.
template <int n, class F>
[[gnu::always_inline]] inline void unroll(F&& f) {
  [&]<int... k>(std::integer_sequence<int, k...>) PORTHOS_INLINE_CALL {
    (f(std::integral_constant<int, k>{}), ...);
  }
  (std::make_integer_sequence<int, n>{});
}
template <int n, class F>
[[gnu::always_inline]] inline void unroll_descending(F&& f) {
  [&]<int... k>(std::integer_sequence<int, k...>) PORTHOS_INLINE_CALL {
    (f(std::integral_constant<int, n - 1 - k>{}), ...);
  }
  (std::make_integer_sequence<int, n>{});
}

}  // namespace porthos::mechanics
