#include "report/detail/series.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

namespace porthos::report::series_test {
namespace {

/// Records made of functions of the record's number.
class Made : public Records {
 public:
  explicit Made(std::int64_t n, bool momenta = true) : n_(n), momenta_(momenta) {}
  std::int64_t count() const override { return n_; }
  std::vector<std::string> names(const std::string& g) const override {
    return g == "stored" ? std::vector<std::string>{"0", "1", "2"} : std::vector<std::string>{};
  }
  bool has(const std::string& name) const override {
    return name != "sweeps" && (momenta_ || !name.ends_with("momentum_error"));
  }
  std::string unit(const std::string&) const override { return ""; }
  std::vector<std::string> columns(const std::string&) const override { return {}; }
  std::string text(const std::string&) const override { return ""; }
  static double value(const std::string& name, std::int64_t i) {
    if (name == "time") return 0.5 * double(i);
    if (name == "step") return double(2 * i);
    if (name.starts_with("stored/"))  // the sum is 3
      return 1 + std::sin(0.7 * double(i) + 2 * std::numbers::pi / 3 * (name.back() - '0'));
    if (name == "energy_error")
      return i == 7777 ? 1.0 : i == 54321 ? -2.0 : 1e-3 * std::sin(0.1 * double(i));
    return 1;
  }
  void read(const std::string& name, const Piece& f) const override {
    EXPECT_TRUE(has(name)) << name;
    const bool vector = name == "linear_momentum_error" || name == "angular_momentum_error";
    const int columns = vector ? 3 : 1;
    for (std::int64_t first = 0; first < n_; first += 1000) {
      const std::int64_t rows = std::min<std::int64_t>(1000, n_ - first);
      std::vector<double> v;
      for (std::int64_t i = first; i < first + rows; ++i)
        for (int c = 0; c < columns; ++c) v.push_back(vector ? double(c + 1) : value(name, i));
      f(first, rows, columns, v.data());
    }
  }

 private:
  std::int64_t n_;
  bool momenta_;
};

template <class T>
std::vector<T> decoded(const std::string& text) {
  std::string bytes;
  unsigned word = 0;
  int bits = 0;
  for (const char c : text) {
    const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const auto d = digits.find(c);
    if (d == digits.npos) break;
    word = word << 6 | unsigned(d);
    bits += 6;
    if (bits >= 8) {
      bits -= 8;
      bytes += char(word >> bits & 255);
    }
  }
  std::vector<T> v(bytes.size() / sizeof(T));
  std::memcpy(v.data(), bytes.data(), v.size() * sizeof(T));
  return v;
}

TEST(Series, Base64OfAllLengths) {
  EXPECT_EQ(base64("", 0), "");
  EXPECT_EQ(base64("f", 1), "Zg==");  // RFC 4648, section 10
  EXPECT_EQ(base64("fo", 2), "Zm8=");
  EXPECT_EQ(base64("foo", 3), "Zm9v");
  EXPECT_EQ(base64("foobar", 6), "Zm9vYmFy");
}

TEST(Series, FewRecordsAreTakenWhole) {
  const Made records(400);
  const Json j = Thinned(records, 200).json();
  EXPECT_TRUE(j["exact"]);
  const auto t = decoded<double>(j["t"]);
  const auto e = decoded<float>(j["energy_error"]);
  ASSERT_EQ(t.size(), 400u);
  for (size_t i = 0; i < t.size(); ++i) {
    EXPECT_EQ(t[i], 0.5 * double(i));
    EXPECT_EQ(e[i], float(Made::value("energy_error", std::int64_t(i))));
  }
}

TEST(Series, NoPeakIsLost) {
  const Made records(100000);
  const Thinned thinned(records, 300);
  const Json j = thinned.json();
  EXPECT_FALSE(j["exact"]);
  const auto t = decoded<double>(j["t"]);
  const auto e = decoded<float>(j["energy_error"]);
  EXPECT_LE(t.size(), 602u);
  ASSERT_EQ(e.size(), t.size());
  EXPECT_EQ(*std::max_element(e.begin(), e.end()), 1.0f);
  EXPECT_EQ(*std::min_element(e.begin(), e.end()), -2.0f);
  EXPECT_TRUE(std::is_sorted(t.begin(), t.end()));
  EXPECT_EQ(t.front(), 0.0);
  EXPECT_EQ(t.back(), 0.5 * 99999);
  // A peak is where it was, to the length of its bucket.
  const auto at = std::min_element(e.begin(), e.end()) - e.begin();
  EXPECT_NEAR(t[size_t(at)], 0.5 * 54321, 0.5 * 100000 / 200);
  // Control: taking every n-th record instead loses it.
  float most = 0;
  for (std::int64_t i = 0; i < 100000; i += 166)
    most = std::max(most, std::fabs(float(Made::value("energy_error", i))));
  EXPECT_LT(most, 0.01f);
}

// Three energies that swing against each other: what is kept in sum is drawn so.
TEST(Series, AStackOfEnergiesIsOfTheSameRecords) {
  const Json stored = Thinned(Made(100000), 300).json()["stored"];
  const auto top = decoded<float>(stored[2]["top"]);
  const auto [low, high] = std::ranges::minmax(top);
  std::vector<float> sum(top.size(), -3);  // control: the sum of what is shown of each
  for (const auto& s : stored) {
    const auto v = decoded<float>(s["v"]);
    for (size_t i = 0; i < v.size(); ++i) sum[i] += v[i];
  }
  const float off = std::fabs(*std::ranges::max_element(sum));
  std::printf("  spread of the sum %.1e   bound 1e-6; of each by itself %.2f\n", high - low, off);
  EXPECT_LT(high - low, 1e-6f);
  EXPECT_GT(off, 1.0f);
}

TEST(Series, LengthsAndRates) {
  const Made records(5000);
  const Json j = Thinned(records, 100).json();
  for (const float x : decoded<float>(j["linear"])) EXPECT_FLOAT_EQ(x, std::sqrt(14.0f));
  for (const float x : decoded<float>(j["step"])) EXPECT_EQ(x, 0.25f);  // 0.5 s in two steps
  EXPECT_FALSE(j.contains("sweeps"));
  const auto rms = decoded<float>(j["energy_rms"]);
  EXPECT_NEAR(rms.back(), 1e-3 / std::sqrt(2.0), 2e-5);
}

// The page says of a momentum without a line that it is no invariant.
TEST(Series, MomentaThatAreNoInvariantsHaveNone) {
  const Json j = Thinned(Made(400, false), 100).json(), with = Thinned(Made(400, true), 100).json();
  for (const char* name : {"linear", "angular"}) {
    EXPECT_FALSE(j.contains(name)) << name;
    EXPECT_TRUE(with.contains(name)) << "control: " << name;
  }
  EXPECT_TRUE(j.contains("energy_error"));
}

}  // namespace
}  // namespace porthos::report::series_test
