// Plans against closed forms, and their cost.
#include "vsa/planning.h"

#include "tests/support/bounds.h"
#include "vsa/catalogue.h"
#include "vsa/families.h"

namespace porthos::test::planning_test {
namespace {

TEST(Planning, AlongLevelsOfEnergyTheWorksAddUpToNothing) {
  const auto lever = vsa::variable_lever({{20, 60, 120}}, {.sigma_lower = 0, .sigma_upper = 1});
  const auto path = vsa::constant_energy_path(*lever, 0.3, 0.1, 0.2, 200);
  double worst = 0;
  for (const auto& p : path)  // k φ² stays
    worst = std::max(worst, std::fabs(p.stiffness * p.phi * p.phi / (27.2 * 0.09) - 1));
  keeps("k phi^2, relative", worst, 1e-14);
  EXPECT_GT(path.back().stiffness, 2 * path.front().stiffness);
  double link = 0, port = 0;  // by the trapezium rule
  for (size_t i = 1; i < path.size(); ++i) {
    const auto a = lever->slopes(path[i - 1].phi, 0.0, path[i - 1].sigma),
               b = lever->slopes(path[i].phi, 0.0, path[i].sigma);
    link += 0.5 * (a.q + b.q) * (path[i].phi - path[i - 1].phi);
    port += 0.5 * (a.sigma + b.sigma) * (path[i].sigma - path[i - 1].sigma);
  }
  std::printf("  stiffness %.1f to %.1f N m/rad: %.4f J by the port, %.4f J by link and motor\n",
              path.front().stiffness, path.back().stiffness, port, link);
  keeps("their sum [J]", std::fabs(link + port), 1e-5);
  breaks("straight there at the deflection held [J]",
         lever->energy(0.3, 0.0, path.back().sigma) - lever->energy(0.3, 0.0, 0.1), 0.5);
}

TEST(Planning, Resonance) {
  const auto lever = vsa::variable_lever({{20, 60, 120}}, {.sigma_lower = 0, .sigma_upper = 1});
  const double inertia = 0.2, omega = 17;  // k = 57.8: σ = (-60 + √(3600 + 480·37.8)) / 240
  const auto r = vsa::resonant_sigma(*lever, inertia, 0.4, omega, 0, 1);
  keeps("sigma of a linear spring", std::fabs(r.sigma - (-60 + std::sqrt(3600 + 480 * 37.8)) / 240),
        1e-8);
  keeps("torque besides the spring's [N m]", r.torque_rms, 1e-6);
  EXPECT_NEAR(r.rigid_rms, inertia * omega * omega * 0.4 / std::sqrt(2.0), 1e-12);
  // The hardening qbmove swings softer at small amplitudes: a smaller σ the farther it goes.
  const auto qbmove = vsa::elastic_of(vsa::device("qbmove_advanced"));
  const auto small = vsa::resonant_sigma(*qbmove, 0.005, 0.02, 15, 0, 0.6),
             large = vsa::resonant_sigma(*qbmove, 0.005, 0.2, 15, 0, 0.6);
  std::printf(
      "  qbmove at 15 rad/s: sigma %.4f for 0.02 rad, %.4f for 0.2 rad; %.3f of %.3f N m left\n",
      small.sigma, large.sigma, large.torque_rms, large.rigid_rms);
  EXPECT_NEAR(small.stiffness, 0.005 * 225, 0.01) << "k = I ω² at small amplitudes";
  EXPECT_LT(large.sigma, small.sigma);
  EXPECT_LT(large.torque_rms, 0.2 * large.rigid_rms);
}

TEST(Planning, WhatCannotBeIsRefused) {
  const auto qbmove = vsa::elastic_of(vsa::device("qbmove_advanced"));
  const auto edinburgh = vsa::elastic_of(vsa::device("edinburgh"));
  EXPECT_NE(refusal([&] {
              vsa::constant_energy_path(*qbmove, 0.1, 0.1, 0.7, 10);
            }).find("has the energy"),
            std::string::npos);
  EXPECT_NE(refusal([&] {
              vsa::constant_energy_path(*edinburgh, 0.1, 1, 0.2, 10);
            }).find("is not translation invariant"),
            std::string::npos);
  EXPECT_NE(refusal([&] {
              vsa::resonant_sigma(*qbmove, 0.01, 0.9, 15, 0, 0.6);
            }).find("is beyond the deflection limit"),
            std::string::npos);
}

}  // namespace
}  // namespace porthos::test::planning_test
