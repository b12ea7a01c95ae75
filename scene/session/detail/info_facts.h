#pragma once
#include <optional>
#include <string>
#include <vector>

#include "scene/assemble/assembly.h"
#include "scene/files/text_table.h"

/// What `porthos info` tells, before it is text or JSON.
namespace porthos::scene {

/// Refuses what a run would refuse before its first step, by its sentence.
/// @param scene  its method stated
/// @throws InvalidArgument
void refuse_as_run(const Scene& scene, const Assembly& assembly);

/// A block of the state with its numbers at the start, seen from the world; angles with turns.
struct StateFacts {
  const phs::Block* block;
  const char* kind;  ///< "linear", "angle", "rotation"
  std::vector<double> start, momentum;
};
std::vector<StateFacts> state_facts(const Assembly& a);

/// The rows that close loops, and how many are independent at the start.
struct ConstraintFacts {
  struct Block {
    std::string name, kind;
    int rows, independent;
    bool unique;  ///< its reaction
  };
  int rows, rank;
  double pivot;  ///< the smallest
  std::vector<Block> blocks;
};
std::optional<ConstraintFacts> constraint_facts(const Assembly& a);

/// Effects that are active or absent, the steps and the records: a name and a sentence each.
TextRows plan_rows(const Scene& s, const Assembly& a);

/// An event of the scene: what happens, when, and of a capture how far its two points are apart at
/// the start [m].
struct EventFacts {
  std::string what, when;
  std::optional<double> apart = {}, reach = {};
};
std::vector<EventFacts> event_facts(const Scene& s, const Assembly& a);

/// Joint properties in the model file that the simulation leaves out.
struct LeftOut {
  std::string joint;
  std::optional<double> lower, upper;
  double friction;  ///< 0: none, or simulated
  const char *unit, *friction_unit;
};
std::vector<LeftOut> left_out_facts(const mechanics::Mechanism& m, bool friction);

/// The measured time of one field evaluation [ns]: of one state, and of each of eight in lanes.
struct EvaluationCost {
  double one, of_eight;
};
EvaluationCost evaluation_cost(const Assembly& a);

/// "AVX-512, 8 numbers at once, multiply-adds fused".
std::string simd_text();

}  // namespace porthos::scene
