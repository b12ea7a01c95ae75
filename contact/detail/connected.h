#pragma once
#include <algorithm>
#include <utility>
#include <vector>

#include "mechanics/constraints/constraint_set.h"
#include "mechanics/mechanical_model.h"
#include "mechanics/passes-inl.h"

namespace porthos::contact {

/// The pairs of nodes, sorted, whose bodies a joint of the tree or of a loop connects; -1: the
/// world. A joint of several freedoms may be a chain with nodes between its two bodies that carry
/// none. A free joint connects nothing, nor does a rod, nor what rolls.
inline std::vector<std::pair<int, int>> connected_nodes(const mechanics::MechanicalModel& model) {
  const auto& nodes = model.mechanism().nodes();
  std::vector<char> carries(nodes.size(), 0);
  for (const auto& body : model.mechanism().bodies())
    if (body.node >= 0) carries[size_t(body.node)] = 1;
  std::vector<std::pair<int, int>> pairs;
  for (size_t k = 0; k < nodes.size(); ++k) {
    bool free = false;
    mechanics::visit_joint(nodes[k].type, [&](auto J) { free = decltype(J)::nv == 6; });
    if (free || !carries[k]) continue;
    int parent = nodes[k].parent;
    while (parent >= 0 && !carries[size_t(parent)]) parent = nodes[size_t(parent)].parent;
    pairs.push_back({parent, int(k)});
  }
  if (const auto* const set = model.constraint_set())
    for (size_t i = 0; i < set->spec().loops.size(); ++i)
      pairs.push_back(std::minmax(int(set->loops()[i].node_a), int(set->loops()[i].node_b)));
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace porthos::contact
