#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "scene/session/records.h"

namespace porthos::report {

using Json = nlohmann::ordered_json;
using scene::Records;

/// Little-endian bytes as base64, for typed arrays of the page.
std::string base64(const void* bytes, size_t size);
std::string base64(const std::vector<float>& v);
std::string base64(const std::vector<double>& v);

/// A run's records reduced so that no peak is lost. Few records are all kept; otherwise each bucket
/// of consecutive records keeps the smallest and the largest value of every series, in their order.
/// Buckets are equally long and, near the start, equally long on a logarithmic axis.
class Thinned {
 public:
  /// most: number of buckets; a run with at most twice as many records is kept whole.
  Thinned(const Records& records, std::int64_t most);

  /// {"t": …, "groups": …}: time, stored, supplied and dissipated energy, errors, steps and sweeps;
  /// the times of several phases follow each other.
  Json json() const;
  std::int64_t records() const { return count_; }
  size_t points() const { return t_.size(); }

 private:
  /// f(row, values) -> the number of a record
  template <class F>
  std::vector<float> thin(const std::string& name, F f) const;
  std::vector<float> column(const std::string& name) const;
  std::vector<float> length(const std::string& name) const;
  std::vector<float> rate(const std::string& name) const;
  Json group(const std::string& name) const;
  /// The stored energies, each with the sum of it and those before it as "top": the least and the
  /// largest of a sum are not those of its parts.
  Json stored() const;

  const Records& records_;
  std::int64_t count_;
  std::vector<std::int64_t> begin_;  ///< first record of each bucket, and the end
  bool whole_;
  std::vector<double> t_;
};

}  // namespace porthos::report
