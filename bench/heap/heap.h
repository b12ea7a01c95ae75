#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>
#include <vector>

/// A heap of balls by several engines (docs/contact.md): what each of them is given, and what is
/// measured of each. Every engine is a program of its own, since their libraries do not go
/// together: heap_<engine> BALLS STEP UNTIL. With HEAP_ELASTIC set the balls lose nothing, and the
/// energy is compared with that of the start.
namespace heap {

using Place = std::array<double, 3>;

/// Balls of 1 kg that fall into a box [0, width]² of five planes, open above.
struct Heap {
  static constexpr double radius = 0.1, inertia = 0.004, g = 9.8125;
  bool elastic = std::getenv("HEAP_ELASTIC") != nullptr;
  double restitution = elastic ? 1 : 0, friction = elastic ? 0 : 0.5;
  size_t n;
  double step, until, width;
  std::vector<Place> start;

  explicit Heap(char** argv)
      : n(size_t(std::atoi(argv[1]))), step(std::atof(argv[2])), until(std::atof(argv[3])) {
    const auto side = size_t(std::cbrt(double(n)) + 0.999);
    width = 0.22 * double(side);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> any(-0.009, 0.009);
    for (size_t i = 0; i < n; ++i) {
      start.push_back({});
      const size_t at[] = {i % side, i / side % side, i / side / side};
      for (size_t a = 0; a < 3; ++a) start[i][a] = 0.22 * double(at[a]) + 0.11 + any(random);
      start[i][2] += 0.05;
    }
  }
  /// The deepest overlap, and the mean of those that are nearer than 1 mm [m].
  std::pair<double, double> overlap(const std::vector<Place>& p) const {
    double most = 0, sum = 0, near = 0;
    const auto look = [&](double gap) {
      if (gap > 1e-3) return;
      ++near;
      sum += std::max(0.0, -gap);
      most = std::max(most, -gap);
    };
    for (size_t i = 0; i < n; ++i) {
      look(p[i][2] - radius);
      for (size_t a = 0; a < 2; ++a) look(p[i][a] - radius), look(width - p[i][a] - radius);
      for (size_t j = 0; j < i; ++j)
        look(std::hypot(p[i][0] - p[j][0], p[i][1] - p[j][1], p[i][2] - p[j][2]) - 2 * radius);
    }
    return {most, sum / std::max(1.0, near)};
  }
};

/// Runs and prints. step() makes a step; state(p, H) tells places and energy.
template <class Step, class State>
void run(const char* engine, const Heap& heap, const Step& step, const State& state) {
  std::vector<Place> p(heap.n), before;
  double H = 0, off = 0, deepest = 0, cpu[3] = {};
  int steps[3] = {};
  state(p, H);
  const double first = H;
  for (int k = 0; k < int(std::lround(heap.until / heap.step)); ++k) {
    const double t = (k + 1) * heap.step;
    const int part = t <= 0.2 ? 0 : t <= heap.until - 0.25 ? 1 : 2;
    const std::clock_t begin = std::clock();
    step();
    cpu[part] += double(std::clock() - begin) / CLOCKS_PER_SEC;
    ++steps[part];
    state(p, H);
    off = std::max(off, std::fabs(H - first));
    if (part < 2) before = p;
    if (k % 10 == 9) deepest = std::max(deepest, heap.overlap(p).first);
  }
  double moved = 0;
  for (size_t i = 0; i < heap.n; ++i)
    for (size_t a = 0; a < 3; ++a) moved += std::pow(p[i][a] - before[i][a], 2);
  std::printf("%s, step %g s: ms per step falling %.2f, landing %.2f, last quarter second %.2f\n",
              engine, heap.step, 1e3 * cpu[0] / std::max(1, steps[0]),
              1e3 * cpu[1] / std::max(1, steps[1]), 1e3 * cpu[2] / std::max(1, steps[2]));
  std::printf("  overlap %.1e m at most, %.1e mean at the end; moved %.1e m in the last quarter\n",
              deepest, heap.overlap(p).second, std::sqrt(moved / double(heap.n)));
  if (heap.elastic) std::printf("  energy off by %.1e of that of the start\n", off / first);
}

}  // namespace heap
