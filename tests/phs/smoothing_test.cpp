#include "phs/functions/smoothing.h"

#include <cmath>
#include <random>

#include "phs/functions/spline.h"
#include "tests/support/bounds.h"

/// The smoothing spline of Reinsch 1967 is what it is said to be.
namespace porthos::test::smoothing_test {
namespace {

using Numbers = std::vector<double>;

struct Noisy {
  Numbers x, exact, y;
};
/// A cubic at places that are not equally far apart, with errors of standard deviation s.
Noisy noisy(double s, int n = 60) {
  std::mt19937_64 generator(4);
  std::normal_distribution<double> error(0, s);
  Noisy all;
  for (int i = 0; i < n; ++i) {
    const double u = 2.0 * i / (n - 1) - 1, x = 0.5 * u + 0.1 * u * u * u;
    all.x.push_back(x);
    all.exact.push_back(5 * x + 40 * x * x * x);
    all.y.push_back(all.exact.back() + error(generator));
  }
  return all;
}

double rms(const Numbers& a, const Numbers& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum / double(a.size()));
}
/// ∫ f''² of the natural spline through g: f'' = 2c + 6d x in each piece.
double bending(const Numbers& x, const Numbers& g) {
  const phs::Spline f(x, g, phs::Spline::Outside::linear, "test");
  double sum = 0;
  for (size_t i = 1; i < x.size(); ++i) {
    const auto& p = f.pieces()[i];
    const double h = x[i] - x[i - 1], a = 2 * p.c, b = a + 6 * p.d * h;
    sum += h * (a * a + a * b + b * b) / 3;
  }
  return sum;
}

TEST(Smoothing, LeavesTheStatedErrors) {
  for (const double s : {0.05, 0.3}) {
    const auto n = noisy(s);
    const auto g = phs::smoothed(n.x, n.y, Numbers(n.x.size(), s));
    // The weight is found to 100 halvings, to rounding of the sum.
    keeps("left over, against s", std::fabs(rms(g, n.y) / s - 1), 1e-12);
    keeps("error of the curve, of s", rms(g, n.exact) / s, 0.6);  // measured 0.37 and 0.55
    breaks("control: that of the numbers", rms(n.y, n.exact) / s, 0.6);
  }
}

// Of curves as near to the numbers none bends less: g with a change d, drawn back to the distance.
TEST(Smoothing, NoCurveAsNearBendsLess) {
  const auto n = noisy(0.05);
  const auto g = phs::smoothed(n.x, n.y, Numbers(n.x.size(), 0.05));
  const double least = bending(n.x, g);
  std::mt19937_64 generator(9);
  std::normal_distribution<double> number(0, 1);
  double smallest = HUGE_VAL;
  for (int k = 0; k < 200; ++k) {
    Numbers other = g;
    const double size = std::pow(10.0, -5 + 0.02 * k), w = 3 * number(generator);
    for (size_t i = 0; i < other.size(); ++i) other[i] += size * std::sin(w * n.x[i] + k);
    const double back = 0.05 / rms(other, n.y);
    if (back > 1) continue;  // nearer than it has to be
    for (size_t i = 0; i < other.size(); ++i) other[i] = n.y[i] + back * (other[i] - n.y[i]);
    smallest = std::min(smallest, bending(n.x, other) / least - 1);
  }
  // ∫ f''² is found from second differences of numbers of 25, with errors of 1e-14 in 0.01².
  keeps("least bending of the others is below by", std::max(0.0, -smallest), 1e-8);
  breaks("control: the numbers themselves bend more, times", bending(n.x, n.y) / least, 10);
}

// Errors that grow with the number are taken out everywhere, by the errors that are stated.
TEST(Smoothing, ErrorsOfEachNumber) {
  std::mt19937_64 generator(4);
  std::normal_distribution<double> number(0, 1);
  Numbers x, y, exact, stated, of_largest;
  for (int i = 0; i <= 80; ++i) {
    x.push_back(-0.5 + i / 80.0);
    exact.push_back(12 * x.back() + 60 * std::pow(x.back(), 3));
    stated.push_back(0.03 * std::fabs(exact.back()));
    y.push_back(exact.back() + stated.back() * number(generator));
  }
  of_largest.assign(81, stated.front());
  const auto soft = [&](const Numbers& g) {  // within 0.15 of zero, where they are up to 2
    double worst = 0;
    for (size_t i = 28; i <= 52; ++i) worst = std::max(worst, std::fabs(g[i] - exact[i]));
    return worst;
  };
  keeps("error where the numbers are small", soft(phs::smoothed(x, y, stated)), 0.06);
  breaks("control: that of the largest for all", soft(phs::smoothed(x, y, of_largest)), 0.1);
  keeps("scatter in units of the stated errors", std::fabs(phs::scatter(x, y, stated) - 1), 0.25);
}

// Noise is told from curves, also of those that turn, and coarse or rounded ones.
TEST(Smoothing, SlopeErrorIsThatOfNoise) {
  std::mt19937_64 generator(2);
  std::normal_distribution<double> number(0, 1);
  Numbers x, noisy, curve, rounded;
  for (int i = 0; i <= 20; ++i) {
    x.push_back(-0.5 + 0.05 * i);
    const double f = 12 * x.back() + 60 * std::pow(x.back(), 3);
    noisy.push_back(f * (1 + 0.03 * number(generator)));
    curve.push_back(std::sin(9 * x.back()) + 20 * x.back());
    rounded.push_back(std::round(1000 * 7 * x.back()) / 1000);
  }
  keeps("a curve", phs::slope_error(x, curve), 0);
  keeps("digits of a straight line", phs::slope_error(x, rounded), 0.01);
  breaks("3 % of noise on 21 places", phs::slope_error(x, noisy), 0.05);
}

TEST(Smoothing, EndsInTheStraightLineOfLeastSquares) {
  const auto n = noisy(0.05, 400);
  const auto g = phs::smoothed(n.x, n.y, Numbers(n.x.size(), 50));
  double x = 0, y = 0, xx = 0, xy = 0;
  for (size_t i = 0; i < 400; ++i) {
    x += n.x[i] / 400;
    y += n.y[i] / 400;
    xx += n.x[i] * n.x[i] / 400;
    xy += n.x[i] * n.y[i] / 400;
  }
  const double slope = (xy - x * y) / (xx - x * x);
  double most = 0;
  for (size_t i = 0; i < 400; ++i)
    most = std::max(most, std::fabs(g[i] - (y + slope * (n.x[i] - x))));
  // QᵀQ of 400 places has the condition 16 (400/π)⁴ = 4e9: 1.1e-16 of it, of corrections of 14.
  keeps("against the line", most, 7e-6);
  breaks("control: against the numbers", rms(g, n.y), 1);
}

}  // namespace
}  // namespace porthos::test::smoothing_test
