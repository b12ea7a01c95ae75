#include "ensemble/sobol.h"

#include <string>

#include "ensemble/random.h"
#include "phs/error.h"

namespace porthos::ensemble {
namespace {

/// From dimension 2 on: degree s and inner coefficients a of the primitive polynomial, and m_1 …
/// m_s.
struct Row {
  int s;
  unsigned a;
  unsigned m[7];
};
constexpr Row table[] = {
    {1, 0, {1}},
    {2, 1, {1, 3}},
    {3, 1, {1, 3, 1}},
    {3, 2, {1, 1, 1}},
    {4, 1, {1, 1, 3, 3}},
    {4, 4, {1, 3, 5, 13}},
    {5, 2, {1, 1, 5, 5, 17}},
    {5, 4, {1, 1, 5, 5, 5}},
    {5, 7, {1, 1, 7, 11, 19}},
    {5, 11, {1, 1, 5, 1, 1}},
    {5, 13, {1, 1, 1, 3, 11}},
    {5, 14, {1, 3, 5, 5, 31}},
    {6, 1, {1, 3, 3, 9, 7, 49}},
    {6, 13, {1, 1, 1, 15, 21, 21}},
    {6, 16, {1, 3, 1, 13, 27, 49}},
    {6, 19, {1, 1, 1, 15, 7, 5}},
    {6, 22, {1, 3, 1, 15, 13, 25}},
    {6, 25, {1, 1, 5, 5, 19, 61}},
    {7, 1, {1, 3, 7, 11, 23, 15, 103}},
    {7, 4, {1, 3, 7, 13, 13, 15, 69}},
    {7, 7, {1, 1, 3, 13, 7, 35, 63}},
    {7, 8, {1, 3, 5, 9, 1, 25, 53}},
    {7, 14, {1, 3, 1, 13, 9, 35, 107}},
    {7, 19, {1, 3, 1, 5, 27, 61, 31}},
    {7, 21, {1, 1, 5, 11, 19, 41, 61}},
    {7, 28, {1, 3, 5, 3, 3, 13, 69}},
    {7, 31, {1, 1, 7, 13, 1, 19, 1}},
    {7, 32, {1, 3, 7, 5, 13, 19, 59}},
    {7, 37, {1, 1, 3, 9, 25, 29, 41}},
    {7, 41, {1, 3, 5, 13, 23, 1, 55}},
    {7, 42, {1, 3, 7, 3, 13, 59, 17}},
    {7, 50, {1, 3, 1, 3, 5, 53, 69}},
    {7, 55, {1, 1, 5, 5, 23, 33, 13}},
    {7, 56, {1, 1, 7, 7, 1, 61, 123}},
    {7, 59, {1, 1, 7, 9, 13, 61, 49}},
    {7, 62, {1, 3, 3, 5, 3, 55, 33}},
};
static_assert(std::size(table) + 1 == size_t(Sobol::most_dimensions));

}  // namespace

Sobol::Sobol(int dimensions, std::uint64_t seed) {
  if (dimensions > most_dimensions)
    throw InvalidArgument("Sobol's sequence in " + std::to_string(dimensions) +
                          " dimensions, expected at most " + std::to_string(most_dimensions));
  direction_.resize(size_t(dimensions * digits));
  for (int d = 0; d < dimensions; ++d) {
    // v_i = m_i / 2^i, stored with the binary point before the highest bit.
    std::uint64_t* v = &direction_[size_t(d * digits)];
    for (int i = 0; i < digits; ++i) {
      const int s = d == 0 ? digits : table[d - 1].s;
      if (d == 0 || i < s) {
        v[i] = std::uint64_t(d == 0 ? 1 : table[d - 1].m[i]) << (63 - i);
        continue;
      }
      v[i] = v[i - s] ^ (v[i - s] >> s);
      for (int k = 1; k < s; ++k)
        if (table[d - 1].a >> (s - 1 - k) & 1) v[i] ^= v[i - k];
    }
    shift_.push_back(Stream(seed, name_bits("sobol"), std::uint64_t(d)).bits());
  }
}

std::uint64_t Sobol::bits(std::uint64_t index, int d) const {
  std::uint64_t x = 0;
  for (int i = 0; index != 0 && i < digits; ++i, index >>= 1)
    if (index & 1) x ^= direction_[size_t(d * digits + i)];
  return x;
}

double Sobol::operator()(std::uint64_t index, int d) const {
  return unit_interval(bits(index, d) ^ shift_[size_t(d)]);
}

}  // namespace porthos::ensemble
