#include "mechanics/momentum.h"
#include "tests/space/support.h"

// Orbit and internal motion together.
namespace porthos::space::split_test {
namespace {

using integrators::Outcome;
using test::breaks;
using test::keeps;

void run(integrators::Integrator& i, phs::State& s, int steps) {
  for (int k = 0; k < steps; ++k) ASSERT_EQ(i.step(s), Outcome::ok) << "step " << k;
}

struct Flight {
  Spacecraft craft;
  phs::State state;
  SplitIntegrator integrator;
  Flight(std::shared_ptr<const mechanics::MechanicalModel> m, const Environment& env,
         std::span<const double> x, const PointState<double>& centre, double h,
         const SplitOptions& o = {})
      : craft(m, m, env),
        state(craft.description(), craft.state(x, centre)),
        integrator(craft, h, o) {}
  OrbitPoint point() const {
    const size_t n = craft.internal_size();
    return load_point(std::span(state.x).subspan(n), std::span(state.lo).subspan(n));
  }
};

TEST(Split, NescCheckCase10A) {
  const auto file = test::read_json(test::data_file("reference/nesc_exo_10A.json"));
  const auto vec = [](const nlohmann::json& j) { return Vec3d{j[0], j[1], j[2]}; };
  const auto& start = file["initial"];
  const auto body = test::rigid_body(file["mass_kg"], vec(file["inertia_kg_m2"]));
  // Rows of T: body axes in inertial components, the columns of the rotation body to inertial.
  const auto xi = test::quaternion({vec(start["T"][0]), vec(start["T"][1]), vec(start["T"][2])});
  Environment env;
  env.planet.mu = file["mu_m3_s2"];
  const auto fly = [&](const char* splitting, double h, double& position, double& attitude,
                       double& rate) {
    Flight f(body, env, test::body_state(*body, xi.data(), vec(start["omega_rad_s"])),
             {vec(start["r_m"]), vec(start["v_m_s"])}, h, {.splitting = splitting});
    run(f.integrator, f.state, int(28800 / h));
    const auto& end = file["final"];
    position = mechanics::norm(Vec3d(f.point().r) - vec(end["r_m"]));
    const auto R = test::attitude(f.state);
    attitude = 0;
    const Vec3d* axes[] = {&R.x, &R.y, &R.z};
    for (size_t i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k)
        attitude = std::max(attitude, std::fabs((*axes[i])[k] - vec(end["T"][i])[k]));
    const auto v = body->rates(std::span(f.state.x).first(14));
    rate = mechanics::norm(Vec3d{v[0], v[1], v[2]} - vec(end["omega_rad_s"]));
    if (h == 10) {
      const auto r = f.integrator.ledgers().report();
      keeps("NESC 10A: gradient's next order, relative", r.next_order, 1e-6);
      keeps("angular momentum against the torque's impulse", r.angular_defect, 1e-14);
    }
  };
  double position, attitude, rate;
  fly("aba864", 10, position, attitude, rate);
  keeps("aba864, 10 s: position [m]", position, 1e-3);
  keeps("attitude matrix", attitude, 1e-9);
  keeps("body rates [rad/s]", rate, 1e-12);
  fly("lobatto8", 10, position, attitude, rate);
  keeps("lobatto8, 10 s: attitude matrix", attitude, 1e-5);
  fly("strang", 10, position, attitude, rate);
  breaks("strang, 10 s: attitude matrix", attitude, 1e-5);
}

TEST(Split, GravityGradientPitchOfTheReference) {
  const auto file = test::read_json(test::data_file("reference/h_gravity_gradient_pitch.json"));
  const double n = 1.0 / 1024, r = 7e6, h = 4;
  const auto body = test::rigid_body(1e6, {6, 8, 10});  // so heavy that nothing acts back
  Environment env;
  env.planet.mu = n * n * r * r * r;
  const double one[] = {1, 0, 0, 0};
  Flight f(body, env, test::body_state(*body, one, {0, 0, 1.5 * n}), {{r, 0, 0}, {0, n * r, 0}}, h,
           {.splitting = "aba864"});
  double worst = 0;
  for (const auto& o : file["outputs"]) {
    const double t = std::stod(o["t"].get<std::string>());
    while (f.state.step * h + h <= t) ASSERT_EQ(f.integrator.step(f.state), Outcome::ok);
    phs::State there = f.state;
    if (t > there.step * h) {
      ASSERT_EQ(f.integrator.step_by(there, t - double(there.step) * h), Outcome::ok);
    }
    const auto R = test::attitude(there);
    const auto g = o["group1"];
    double off = 0;
    for (int i = 0; i < 3; ++i) {
      const Vec3d row{R.x[i], R.y[i], R.z[i]};
      for (int k = 0; k < 3; ++k)
        off = std::max(off, std::fabs(row[k] - std::stod(g[size_t(3 * i + k)].get<std::string>())));
    }
    std::printf("  t = %-8g attitude off by %.1e\n", t, off);
    worst = std::max(worst, off);
  }
  keeps("nonlinear pitch, ten orbits, 4 s", worst, 1e-9);
}

TEST(Split, LibrationPeriodsOfTheCylinder) {
  // The long axis near the vertical, in the orbit of the check case: pitch in the plane of the
  // orbit, roll across it.
  const double a = 6758662.024, mu = 398600441500000.0, n = std::sqrt(mu / a) / a;
  const auto body = test::rigid_body(1000, {500, 12250, 12250});
  Environment env;
  env.planet.mu = mu;
  const double sigma = 11750.0 / 12250, known[] = {3257.94, 2821.46};
  // Roll: the body is symmetric about its long axis, so its rate about that stays, and yaw' = -n
  // roll + constant adds (1 - sigma) n² to the textbook's 4 sigma n², which holds yaw still: half a
  // percent of the period.
  const double analytic[] = {std::sqrt(3 * sigma), std::sqrt(1 + 3 * sigma)};
  for (const int roll : {0, 1}) {
    const double half = 0.5 * 0.01, h = 20;
    // x up, y along the velocity, z across; tilted by 0.01 rad about z (pitch) or y (roll)
    const double xi[] = {std::cos(half), 0, roll ? std::sin(half) : 0, roll ? 0 : std::sin(half)};
    const double tilt = 2 * half;
    const Vec3d rate = roll ? Vec3d{-n * std::sin(tilt), 0, n * std::cos(tilt)} : Vec3d{0, 0, n};
    Flight f(body, env, test::body_state(*body, xi, rate), {{a, 0, 0}, {0, n * a, 0}}, h);
    double before = 0, first = -1, last = 0;
    int crossings = 0;
    for (int k = 1; k < int(20 * 3300 / h); ++k) {
      ASSERT_EQ(f.integrator.step(f.state), Outcome::ok);
      const Vec3d u = (1 / a) * Vec3d(f.point().r), x = test::attitude(f.state).x;
      const double angle = roll ? x.z : cross(u, x).z;
      if (before < 0 && angle >= 0) {
        last = h * (k - angle / (angle - before));
        if (first < 0)
          first = last;
        else
          ++crossings;
      }
      before = angle;
    }
    const double period = (last - first) / crossings;
    std::printf("  %s: %.2f s, reference %.2f s\n", roll ? "roll" : "pitch", period, known[roll]);
    keeps("period against the motion's own",
          std::fabs(period * n * analytic[roll] / 6.283185307179586 - 1), 1e-4);
    // The known figure of roll leaves the coupling with yaw out, half a percent of the period.
    const double coupling = roll ? std::sqrt((1 + 3 * sigma) / (4 * sigma)) : 1;
    keeps("period against the reference", std::fabs(period * coupling / known[roll] - 1), 1e-3);
    if (roll) breaks("and with the coupling", std::fabs(period / known[1] - 1), 3e-3);
  }
}

PointState<double> low_orbit(const Environment& env) {
  return from_elements(env.planet.mu, 6928e3, 0.001, 0.6109, 0.3, 0.2, 0);
}

TEST(Split, ThreeLedgersOfAnArmInOrbit) {
  const auto arm = test::ets_vii(0.3);
  Environment env;
  env.planet.J = earth_zonals();
  Flight f(arm.model, env, arm.start.x, low_orbit(env), 4);
  test::Gauge gauge(f.craft);
  const long double H0 = gauge.energy(f.state);
  double work = 0, worst = 0;
  for (int k = 0; k < 20000; ++k) {
    ASSERT_EQ(f.integrator.step(f.state), Outcome::ok);
    work += f.integrator.port_work().back();
    if (k % 20 == 0)
      worst = std::max(worst, std::fabs(double((gauge.energy(f.state) - H0 - work) / H0)));
  }
  const auto r = f.integrator.ledgers().report();
  keeps("orbital ledger: defect / |E|, 22 h", r.orbital.largest_defect / r.orbital.scale, 1e-16);
  // The largest of a random walk: 8.2e-14 and 1.04e-13 with two roundings of the same field.
  keeps("internal ledger: defect / H", worst, 2e-13);
  keeps("coupling ledger: defect / largest V", r.coupling.largest_defect / r.coupling.scale, 1e-4);
  keeps("harmonics' ledger: defect / largest V", r.harmonics.largest_defect / r.harmonics.scale,
        1e-8);
  keeps("angular momentum against the gradient's impulse", r.angular_defect, 1e-13);
  breaks("impulse of the gradient over the angular momentum, so that there was some",
         r.angular_impulse / r.angular_momentum, 1e-2);
  breaks("work of the gradient over H", std::fabs(work / double(H0)), 1e-9);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(f.state.x[size_t(f.craft.mechanism().nq() + k)], 0.0);
}

TEST(Split, CouplingLedgerShowsTheOrder) {
  const auto arm = test::ets_vii(0.1);
  Environment env;
  const auto defect = [&](const char* splitting, double h) {
    Flight f(arm.model, env, arm.start.x, low_orbit(env), h, {.splitting = splitting});
    run(f.integrator, f.state, int(8000 / h));
    const auto r = f.integrator.ledgers().report();
    return r.coupling.largest_defect / r.coupling.scale;
  };
  for (const auto& [splitting, order] :
       {std::pair{"strang", 2.0}, {"lobatto4", 4.0}, {"aba864", 7.5}}) {
    const double coarse = defect(splitting, 16), fine = defect(splitting, 8);
    std::printf("  %-9s %.2e at 16 s, %.2e at 8 s, order %.2f\n", splitting, coarse, fine,
                std::log2(coarse / fine));
    EXPECT_GT(std::log2(coarse / fine), order - 1.5) << splitting;
  }
}

TEST(Split, MemoryContinuesBitForBit) {
  const auto arm = test::ets_vii(0.3);
  Environment env;
  Flight a(arm.model, env, arm.start.x, low_orbit(env), 4),
      b(arm.model, env, arm.start.x, low_orbit(env), 4);
  run(a.integrator, a.state, 30);
  b.state = a.state;
  b.integrator.restore(a.integrator.memory());
  run(a.integrator, a.state, 30);
  run(b.integrator, b.state, 30);
  EXPECT_TRUE(a.state == b.state);
  EXPECT_EQ(a.integrator.memory(), b.integrator.memory());
}

}  // namespace
}  // namespace porthos::space::split_test
