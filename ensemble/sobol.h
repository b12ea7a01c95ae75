#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace porthos::ensemble {

/// Points that fill the unit cube more evenly than random ones: Sobol's sequence with a random
/// digital shift.
///
/// In base 2, every block of 2^k points that starts at a multiple of 2^k has one point in each of
/// 2^k equal intervals of every coordinate. Averages over N points, preferably a power of 2,
/// converge almost as 1/N if the integrand is smooth. The shift (exclusive or of the bits of each
/// coordinate with random bits) preserves this and makes the average unbiased. A point is computed
/// from its index alone.
///
/// Sources: Sobol 1967; direction numbers of Joe, Kuo 2008 (SIAM J. Sci. Comput. 30:2635, their
/// table of criterion D6); digital shift: L'Ecuyer, Lemieux 2002.
class Sobol {
 public:
  static constexpr int most_dimensions = 37;

  /// @throws InvalidArgument for more dimensions than the table has
  Sobol(int dimensions, std::uint64_t seed);

  /// Coordinate d of point `index`, in (0, 1).
  double operator()(std::uint64_t index, int d) const;
  /// The bits before the shift, with the first bit in the highest place.
  std::uint64_t bits(std::uint64_t index, int d) const;

 private:
  static constexpr int digits = 52;
  std::vector<std::uint64_t> direction_;  ///< [dimension][digit]
  std::vector<std::uint64_t> shift_;      ///< per dimension
};

}  // namespace porthos::ensemble
