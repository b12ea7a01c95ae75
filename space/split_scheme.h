#pragma once
#include <string>
#include <vector>

/// Splittings of a motion into a large solvable part (drift) and a small one (kick), H = A + ε B.
namespace porthos::space {

/// kick[0] h, drift[0] h, kick[1] h, … drift[n-1] h, kick[n] h; the same read backwards. A kick of
/// weight 0 is none.
struct SplitScheme {
  std::string name, title;
  std::vector<double> kick, drift;
  int order = 2;        ///< in h, of the terms in ε²
  int small_order = 2;  ///< in h, of the terms linear in ε
  bool forward = true;  ///< no step backwards: fit for damped motions
  /// c of the error c h² ε² {{A,B},B} in the energy a Lobatto scheme keeps, which a corrected one
  /// takes away by a further kick at both ends, of the gravity gradient and the harmonics; 0: not
  /// corrected
  double corrector = 0;
  std::string source;
};

/// "strang", "lobatto4", "lobatto6", "lobatto8" (kicks at Lobatto's nodes with their weights), the
/// corrected "lobatto4c", "lobatto6c", "lobatto8c", and "aba864".
const std::vector<SplitScheme>& split_schemes();
/// @throws InvalidArgument for an unknown name, with the known ones
const SplitScheme& split_scheme(const std::string& name);

}  // namespace porthos::space
