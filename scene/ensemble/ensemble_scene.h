#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ensemble/distribution.h"
#include "ensemble/sobol.h"
#include "scene/assemble/assembly.h"
#include "scene/read/variation.h"

/// The [ensemble] of a scene: many runs that differ in some of its numbers. Keys: docs/ensemble.md.
namespace porthos::scene {

/// A key of the scene that differs from case to case.
struct Quantity {
  std::string key;                           ///< see Replacement
  ensemble::Distribution distribution = {};  ///< unused if a table has the values
  std::string where = {};                    ///< "file:line:column"
  int size() const { return distribution.size(); }
};

/// The table [ensemble] of a scene.
struct EnsembleScene {
  std::int64_t cases = 0;
  std::uint64_t seed = 1;
  bool sobol = false;
  std::vector<Quantity> quantities;    ///< in the order of their keys, or of the table's columns
  std::string table_path, table_text;  ///< of a CSV file; empty: sampled
  std::vector<std::vector<double>> rows = {};  ///< of it, one per case

  /// How many numbers define a case: those of each quantity, one after another.
  int columns() const;
  /// "initial.base.attitude_wxyz[0]", …
  std::vector<std::string> column_names() const;
};

/// Reads [ensemble] of a scene that has been read, and tries each quantity on it.
/// @throws InvalidArgument "file:line:column: …", for a missing table, unknown keys, a quantity
/// that has no place in the scene, a distribution that is empty or unknown, a broken table
EnsembleScene read_ensemble(const Scene& scene, const Assembly& assembly);

/// The numbers of each case, determined by its index alone.
class CaseSampler {
 public:
  explicit CaseSampler(const EnsembleScene& e);
  /// Size EnsembleScene::columns().
  std::vector<double> values(std::int64_t index) const;
  /// The replacements in the scene for `values`.
  std::vector<Replacement> replacements(std::span<const double> values) const;

 private:
  const EnsembleScene& e_;
  std::optional<ensemble::Sobol> sobol_;
};

}  // namespace porthos::scene
