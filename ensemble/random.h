#pragma once
#include <array>
#include <cstdint>
#include <string_view>

/// Random numbers that depend on a key, not on the order of requests.
namespace porthos::ensemble {

/// The stream of a seed and two numbers, such as an ensemble's seed, a case and a quantity. It has
/// the same numbers on every machine, in any thread, for any order of cases. Philox4x64-10 (Salmon,
/// Moraes, Dror, Shaw 2011, "Parallel random numbers: as easy as 1, 2, 3"), counted up from (0, 0,
/// b, a) under the key (seed, 0).
class Stream {
 public:
  Stream(std::uint64_t seed, std::uint64_t a, std::uint64_t b) : seed_(seed), a_(a), b_(b) {}

  std::uint64_t bits();
  /// In (0, 1): the middle of one of 2^52 equal intervals.
  double uniform();
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Normal, mean 0, deviation 1.
  double normal();

 private:
  std::uint64_t seed_, a_, b_, count_ = 0;
  std::array<std::uint64_t, 4> block_{};
};

/// A number in (0, 1) from the 52 highest bits.
inline double unit_interval(std::uint64_t bits) { return (double(bits >> 12) + 0.5) * 0x1p-52; }

/// The p-quantile of a normal variable (mean 0, deviation 1), 0 < p < 1; relative error below
/// 1e-15. Source: Wichura 1988, algorithm AS 241, PPND16.
double normal_quantile(double p);

/// 64 bits of a name (FNV-1a: Fowler, Noll, Vo).
std::uint64_t name_bits(std::string_view name);

}  // namespace porthos::ensemble
