#pragma once
#include <string>
#include <vector>

/// Coefficients of compositions: palindromic sequences γ_1 … γ_s with sum 1.
namespace porthos::integrators {

/// The middle of a palindrome, derived so that the sum is 1.
enum class Centre {
  one,  ///< γ = 1 - 2Σ, once
  two   ///< γ = 1/2 - Σ, twice
};

/// A palindromic composition, given by the independent half of its coefficients.
struct CompositionTable {
  std::string name;   ///< of the method: "yoshida4"
  std::string title;  ///< for readers
  int order;
  Centre centre;
  std::vector<const char*> outer;  ///< γ_1 … γ_m before the middle, decimals to 42 places
  std::string source;

  int stages() const { return 2 * int(outer.size()) + (centre == Centre::one ? 1 : 2); }
  /// All γ, rounded to a common unit (2^-51 for double, 2^-109 for Quad) so that their sum is
  /// exactly 1.
  template <class T>
  std::vector<T> gammas() const;
};

/// Ψ(γ_s h) ∘ … ∘ Ψ(γ_1 h) of a symmetric Ψ (Hairer, Lubich, Wanner 2006, V.3.2).
const std::vector<CompositionTable>& symmetric_compositions();
/// Φ*(γ_s h) ∘ Φ(γ_{s-1} h) ∘ … ∘ Φ*(γ_2 h) ∘ Φ(γ_1 h) of any first-order Φ and its adjoint (op.
/// cit. V.3.1). With Φ(h) = B(h) ∘ A(h) the flows of equal parts merge into the splitting A(a_1 h),
/// B(b_1 h), A(a_2 h), …: γ_1 = a_1, γ_2 = b_1 - γ_1, γ_3 = a_2 - γ_2, … Its order is the same for
/// any number of parts (McLachlan 1995).
const std::vector<CompositionTable>& adjoint_compositions();

/// @throws InvalidArgument if there is no table of that name
const CompositionTable& composition_table(const std::string& name);

}  // namespace porthos::integrators
