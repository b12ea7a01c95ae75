#pragma once
#include <fmt/format.h>

#include <map>
#include <string>
#include <vector>

#include "mechanics/rotation.h"
#include "scene/files/hdf5_reader.h"
#include "tests/run/scenes.h"

namespace porthos::test {

/// The columns of a run of ours as another program would write them: true angles, world velocity
/// and body rates of the base.
inline std::string csv_of(const Case& c, const fs::path& run, const std::string& torque = "") {
  const scene::Hdf5Reader file(run / "run.h5");
  const auto read = [&](const std::string& name) {
    std::vector<double> x(size_t(file.dataset(name).size()));
    file.read(name, x.data());
    return x;
  };
  const auto t = read("time");
  const auto& m = *c.assembly.mechanism;
  const auto& d = c.assembly.mechanical->description();
  std::vector<std::int64_t> turns(size_t(file.dataset("turns").size()));
  file.read("turns", turns.data());
  const size_t angles = turns.size() / t.size();
  std::map<std::string, std::vector<double>> series;
  for (const auto& b : d.blocks) {
    series["q" + b.name] = read("state/" + b.name);
    series["p" + b.name] = read("momentum/" + b.name);
  }
  std::string text = "time";
  for (const char* kind : {"", "v."})
    for (const auto& k : m.coordinates()) {
      const int n = *kind ? k.nv : k.nq;
      for (int i = 0; i < n; ++i)
        text += fmt::format(",{}{}{}", kind, k.name, n > 1 ? fmt::format("[{}]", i) : "");
    }
  text += torque.empty() ? "\n" : ",torque." + torque + "\n";
  for (size_t i = 0; i < t.size(); ++i) {
    std::vector<double> x(size_t(d.nx));
    for (const auto& b : d.blocks)
      for (int k = 0; k < b.size; ++k) {
        x[size_t(b.at + k)] = series["q" + b.name][i * size_t(b.size) + size_t(k)];
        x[size_t(b.momentum + k)] = series["p" + b.name][i * size_t(b.size) + size_t(k)];
      }
    const auto here = std::span(turns).subspan(i * angles, angles);
    auto v = c.assembly.mechanical->rates(x, here);
    size_t a = 0;
    text += fmt::format("{}", t[i]);
    for (const auto& k : m.coordinates())
      for (int n = 0; n < k.nq; ++n)
        text += fmt::format(",{}", x[size_t(k.q + n)] + (k.kind == phs::BlockKind::angle
                                                             ? phs::two_pi_hi * double(here[a++])
                                                             : 0.0));
    for (const auto& k : m.coordinates())
      if (k.name == "base.position") {
        const auto& at = m.coordinate("base.attitude");
        const auto xi = mechanics::Quaternion<double>::load(&x[size_t(at.q)]);
        const auto w = mechanics::rotation_matrix(xi) *
                       mechanics::Vec3d{v[size_t(k.v)], v[size_t(k.v) + 1], v[size_t(k.v) + 2]};
        for (int n = 0; n < 3; ++n) v[size_t(k.v + n)] = w[n];
      }
    for (const auto& k : m.coordinates())
      for (int n = 0; n < k.nv; ++n) text += fmt::format(",{}", v[size_t(k.v + n)]);
    if (!torque.empty()) text += fmt::format(",{}", 3 * std::sin(2 * M_PI * 0.4 * t[i]));
    text += "\n";
  }
  return text;
}

}  // namespace porthos::test
