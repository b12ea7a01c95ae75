#include "report/detail/series.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "scene/plot/shown.h"

namespace porthos::report {

static_assert(std::endian::native == std::endian::little);

std::string base64(const void* bytes, size_t size) {
  static constexpr char digits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const auto* b = static_cast<const unsigned char*>(bytes);
  std::string text;
  text.reserve((size + 2) / 3 * 4);
  for (size_t i = 0; i < size; i += 3) {
    const unsigned two = i + 1 < size ? b[i + 1] : 0u, three = i + 2 < size ? b[i + 2] : 0u;
    const unsigned word = unsigned(b[i]) << 16 | two << 8 | three;
    text += digits[word >> 18];
    text += digits[word >> 12 & 63];
    text += i + 1 < size ? digits[word >> 6 & 63] : '=';
    text += i + 2 < size ? digits[word & 63] : '=';
  }
  return text;
}
std::string base64(const std::vector<float>& v) {
  return base64(v.data(), v.size() * sizeof(float));
}
std::string base64(const std::vector<double>& v) {
  return base64(v.data(), v.size() * sizeof(double));
}

Thinned::Thinned(const Records& records, std::int64_t most)
    : records_(records), count_(records.count()), whole_(count_ <= 2 * most) {
  if (whole_) {
    for (std::int64_t i = 0; i <= count_; ++i) begin_.push_back(i);
  } else {  // a third of the buckets for the logarithmic axis
    const std::int64_t even = 2 * most / 3, logarithmic = most - even;
    for (std::int64_t k = 0; k <= even; ++k)
      begin_.push_back(std::llround(double(count_) * double(k) / double(even)));
    for (std::int64_t k = 0; k < logarithmic; ++k)
      begin_.push_back(std::llround(std::pow(double(count_), double(k) / double(logarithmic))));
    std::sort(begin_.begin(), begin_.end());
    begin_.erase(std::unique(begin_.begin(), begin_.end()), begin_.end());
  }
  size_t k = 0;
  records.read("time", [&](std::int64_t first, std::int64_t rows, int, const double* v) {
    for (std::int64_t i = first; i < first + rows; ++i) {
      if (i == begin_[k + 1]) ++k;
      const bool opens = i == begin_[k], closes = i + 1 == begin_[k + 1];
      if (opens) t_.push_back(v[i - first]);
      if (closes && !whole_) t_.push_back(v[i - first]);
    }
  });
}

template <class F>
std::vector<float> Thinned::thin(const std::string& name, F f) const {
  std::vector<float> out;
  out.reserve(t_.size());
  size_t k = 0;
  scene::LeastAndLargest bucket;
  records_.read(name, [&](std::int64_t first, std::int64_t rows, int columns, const double* v) {
    for (std::int64_t i = first; i < first + rows; ++i) {
      const double x = f(i, columns, v + (i - first) * columns);
      if (whole_) {
        out.push_back(float(x));
        continue;
      }
      bucket.add(x);
      if (k + 1 == begin_.size() || i + 1 < begin_[k + 1]) continue;
      out.push_back(float(bucket.first()));
      out.push_back(float(bucket.second()));
      bucket = {};
      ++k;
    }
  });
  out.resize(t_.size(), NAN);  // of a log that grew or a file that ends early
  return out;
}

std::vector<float> Thinned::column(const std::string& name) const {
  return thin(name, [](std::int64_t, int, const double* v) { return v[0]; });
}

std::vector<float> Thinned::length(const std::string& name) const {
  return thin(name, [](std::int64_t, int columns, const double* v) {
    double square = 0;
    for (int c = 0; c < columns; ++c) square += v[c] * v[c];
    return std::sqrt(square);
  });
}

/// Change per step: for time, the mean step between two records; for sweeps, the sweeps of a step.
std::vector<float> Thinned::rate(const std::string& name) const {
  std::vector<double> steps;
  records_.read("step", [&](std::int64_t, std::int64_t rows, int, const double* v) {
    steps.insert(steps.end(), v, v + rows);
  });
  double before = 0, value = NAN;
  auto out = thin(name, [&](std::int64_t i, int, const double* v) {
    if (i > 0 && steps[size_t(i)] > steps[size_t(i) - 1])
      value = (v[0] - before) / (steps[size_t(i)] - steps[size_t(i) - 1]);
    before = v[0];
    return value;
  });
  const auto known = std::find_if(out.begin(), out.end(), [](float x) { return !std::isnan(x); });
  if (known != out.end())
    std::fill(out.begin(), known, *known);  // the first record has no predecessor
  return out;
}

Json Thinned::group(const std::string& name) const {
  Json list = Json::array();
  for (const auto& series : records_.names(name))
    list.push_back({{"name", series}, {"v", base64(column(name + "/" + series))}});
  return list;
}

Json Thinned::stored() const {
  Json list = group("stored");
  std::vector<double> sum(size_t(count_), 0.0);
  for (auto& s : list) {
    const auto top =
        thin("stored/" + s["name"].get<std::string>(), [&](std::int64_t i, int, const double* v) {
          return i < count_ ? sum[size_t(i)] += v[0] : NAN;
        });
    s["top"] = base64(top);
  }
  return list;
}

Json Thinned::json() const {
  double squares = 0;
  auto rms = thin("energy_error", [&](std::int64_t i, int, const double* v) {
    squares += v[0] * v[0];
    return std::sqrt(squares / double(i + 1));
  });
  Json j = {{"records", count_},
            {"exact", whole_},
            {"t", base64(t_)},
            {"stored", stored()},
            {"supplied", group("supplied")},
            {"dissipated", group("dissipated")},
            {"energy_error", base64(column("energy_error"))},
            {"energy_rms", base64(rms)},
            {"step", base64(rate("time"))}};
  for (const auto& [key, name] : {std::pair{"linear", "linear_momentum_error"},
                                  {"angular", "angular_momentum_error"},
                                  {"quaternion", "quaternion_norm_error"}})
    if (records_.has(name))
      j[key] = base64(length(name));  // none is no invariant: the page says so
  if (records_.has("sweeps")) j["sweeps"] = base64(rate("sweeps"));
  return j;
}

}  // namespace porthos::report
