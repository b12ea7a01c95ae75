#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace porthos::ensemble {

/// Points that fill the unit cube more evenly than random ones: Sobol's sequence, shifted digitally
/// at random.
///
/// In base 2 every stretch of 2^k points that begins at a multiple of 2^k has one point in each of
/// 2^k equal intervals of every coordinate; averages over N points, best a power of 2, converge
/// almost as 1/N where the integrand is smooth. The shift (the bits of each coordinate, exclusive
/// or with random ones) keeps this and makes the average unbiased. Points are found by their index
/// alone.
///
/// Sources: Sobol 1967; direction numbers of Joe, Kuo 2008 (SIAM J. Sci. Comput. 30:2635, their
/// table of criterion D6); digital shift: L'Ecuyer, Lemieux 2002.
class Sobol {
 public:
  static constexpr int most_dimensions = 37;

  /// @throws InvalidArgument for more dimensions than there are in the table
  Sobol(int dimensions, std::uint64_t seed);

  /// Coordinate d of point `index`, in (0, 1).
  double operator()(std::uint64_t index, int d) const;
  /// Its bits before the shift, the first in the highest place.
  std::uint64_t bits(std::uint64_t index, int d) const;

 private:
  static constexpr int digits = 52;
  std::vector<std::uint64_t> direction_;  ///< [dimension][digit]
  std::vector<std::uint64_t> shift_;      ///< per dimension
};

}  // namespace porthos::ensemble
