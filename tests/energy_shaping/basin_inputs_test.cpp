// The largest input on the level set of a basin, against a closed form.
#include "energy_shaping/certify/detail/basin_inputs.h"

#include "tests/energy_shaping/robots.h"

namespace porthos::energy_shaping::basin_inputs_test {
namespace {

using test::Vec;

/// Three sliders at right angles that carry 3, 2 and 1 kg.
test::ModelPtr gantry() {
  mechanics::MechanismBuilder b("gantry");
  for (int i = 0; i < 3; ++i) {
    mechanics::BodySpec s;
    s.name = "car_" + std::to_string(i);
    s.parent = i ? "car_" + std::to_string(i - 1) : "world";
    s.joint.name = "axis_" + std::to_string(i);
    s.joint.type = "prismatic";
    s.joint.axis = {double(i == 0), double(i == 1), double(i == 2)};
    s.mass.mass = 1;
    s.mass.inertia = {0.1, 0, 0, 0.1, 0, 0.1};
    b.add(s);
  }
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));
}

/// u_j = -k_j (q_j - q*_j) - d_j v_j is at most sqrt(2 c (k_j + d_j²/m_j)) on H_d = c, wherever the
/// rest point is. Control: a limit between, which is passed at a few places alone, is told.
TEST(BasinInputs, AreThoseOfTheClosedForm) {
  const double k[] = {4, 9, 1}, d[] = {1, 0.5, 6}, m[] = {3, 2, 1}, reach = 2;
  PotentialShaping s;
  s.rest = {5, -7, 3};
  for (int i = 0; i < 3; ++i) {
    const std::string axis = "axis_" + std::to_string(i);
    s.joints.push_back({axis + ".force", k[i], s.rest[size_t(i)]});
    s.damping.push_back({axis + ".force", {d[i]}});
  }
  const PotentialLoop loop(gantry(), s);
  CertifyOptions o;
  for (const double q : s.rest) {
    o.region.lower.push_back(q - reach);
    o.region.upper.push_back(q + reach);
  }
  const Basin b = basin(loop, o.region);
  const double c = 0.5 * 1 * reach * reach;  // the softest reaches the border first
  double most = 0;
  for (int i = 0; i < 3; ++i)
    most = std::max(most, std::sqrt(2 * b.depth * (k[i] + d[i] * d[i] / m[i])));
  const auto largest = [&](const Vec& limits, std::string& text) {
    Certificate told("gantry");
    inputs_on_basin(loop, o.region, b, limits, told);
    text = told.item("input on the basin").text;
    return told.item("input on the basin").value;
  };
  std::string free, limited;
  const double found = largest({}, free) / most;
  std::printf("  c is %.4f of the exact, the largest input %.5f   bounds 0.99, 0.9999\n",
              b.depth / c, found);
  EXPECT_GT(b.depth, 0.99 * c);
  EXPECT_GT(found, 0.9999);
  EXPECT_LE(found, 1 + 1e-9);
  largest(Vec(3, 0.98 * most), limited);
  std::printf("  %s\n", limited.c_str());
  EXPECT_NE(limited.find("it acts from"), limited.npos);
  largest(Vec(3, 1.02 * most), limited);
  EXPECT_NE(limited.find("it does not act below c"), limited.npos);
}

}  // namespace
}  // namespace porthos::energy_shaping::basin_inputs_test
