#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "report/records.h"

namespace porthos::report {

using Json = nlohmann::ordered_json;

/// Little-endian bytes as base64, for typed arrays of the page.
std::string base64(const void* bytes, size_t size);
std::string base64(const std::vector<float>& v);
std::string base64(const std::vector<double>& v);

/// A run's records thinned out so that no peak is lost: all of them where they are few; else of
/// each bucket of consecutive records the least and the greatest value of every series, in the
/// order they came. Buckets are equally long and, near the start, equally long on a logarithmic
/// axis.
class Thinned {
 public:
  /// most: buckets; whatever has no more than twice as many records is taken whole.
  Thinned(const Records& records, std::int64_t most);

  /// {"t": …, "groups": …}: time, what is stored, supplied and dissipated, errors, steps and
  /// sweeps; times of several phases follow each other.
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

  const Records& records_;
  std::int64_t count_;
  std::vector<std::int64_t> begin_;  ///< first record of each bucket, and the end
  bool whole_;
  std::vector<double> t_;
};

}  // namespace porthos::report
