#pragma once
#include <string>
#include <vector>

/// Splittings of a motion into a large solvable part (drift) and a small one (kick), H = A + ε B.
namespace porthos::space {

/// kick[0] h, drift[0] h, kick[1] h, … drift[n-1] h, kick[n] h; palindromic. A kick of weight 0 is
/// skipped.
struct SplitScheme {
  std::string name, title;
  std::vector<double> kick, drift;
  int order = 2;        ///< in h, of the terms in ε²
  int small_order = 2;  ///< in h, of the terms linear in ε
  bool forward = true;  ///< no backward steps: suitable for damped motions
  /// c of the error c h² ε² {{A,B},B} in the energy that a Lobatto scheme conserves. A corrected
  /// scheme removes it by a further kick at both ends, of the gravity gradient and the harmonics;
  /// 0: not corrected
  double corrector = 0;
  std::string source;
};

/// "strang", "lobatto4", "lobatto6", "lobatto8" (kicks at Lobatto nodes with Lobatto weights),
/// their corrected forms "lobatto4c", "lobatto6c", "lobatto8c", and "aba864".
const std::vector<SplitScheme>& split_schemes();
/// @throws InvalidArgument for an unknown name, listing the known ones
const SplitScheme& split_scheme(const std::string& name);

}  // namespace porthos::space
