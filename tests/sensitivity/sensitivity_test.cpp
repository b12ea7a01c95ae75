// Slopes of the end of a run: against closed forms and differences of whole runs; a control.
#include "scene/sensitivity/sensitivity.h"

#include <fmt/format.h>

#include <cmath>
#include <map>

#include "integrators/derivatives/run_gradient.h"
#include "mechanics/rotation.h"
#include "phs/scalars/scalar.h"
#include "scene/assemble/outputs.h"
#include "scene/assemble/steps.h"
#include "scene/sensitivity/end_quantities.h"
#include "scene/sensitivity/ridders.h"
#include "tests/places.h"
#include "tests/scene/scene_files.h"

namespace porthos::scene::sensitivity_test {
namespace {

using phs::Dual;
using Numbers = std::map<std::string, double>;

double number(const Numbers& n, const std::string& name, double otherwise = 0) {
  const auto at = n.find(name);
  return at == n.end() ? otherwise : at->second;
}

/// A link of a URDF from the numbers "<name>.mass", ".com.x", ".inertia.xx" …
std::string link(const Numbers& n, const std::string& name, const std::string& rpy) {
  const auto of = [&](const char* what) { return number(n, name + what); };
  return fmt::format(
      R"(<link name="{}"><inertial><origin xyz="{:.17g} {:.17g} {:.17g}" rpy="{}"/>
<mass value="{:.17g}"/><inertia ixx="{:.17g}" ixy="{:.17g}" ixz="{:.17g}" iyy="{:.17g}" iyz="{:.17g}" izz="{:.17g}"/></inertial></link>
)",
      name, of(".com.x"), of(".com.y"), of(".com.z"), rpy, of(".mass"), of(".inertia.xx"),
      of(".inertia.xy"), of(".inertia.xz"), of(".inertia.yy"), of(".inertia.yz"),
      of(".inertia.zz"));
}

std::string joint(const Numbers& n, const std::string& name, const std::string& type,
                  const std::string& parent, const std::string& child, const std::string& axis,
                  const std::string& at) {
  return fmt::format(
      R"(<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/><origin xyz="{}"/>
<axis xyz="{}"/><dynamics damping="{:.17g}"/></joint>
)",
      name, type, parent, child, at, axis, number(n, name + ".damping"));
}

class SensitivityOfScenes : public SceneFiles {
 protected:
  Scene scene_of(const std::string& urdf, const std::string& text) const {
    write("model.urdf", urdf);
    return read(text);
  }
};

// --- closed form ---------------------------------------------------------------------------------

/// A mass on a spring with damping: place and rate at time T, in duals.
struct Oscillator {
  double m = 2, d = 0.3, k = 5, x = 0.4, v = -0.7, T = 6;

  std::pair<Dual, Dual> end(const std::string& seeded) const {
    const auto dual = [&](const char* name, double value) {
      return Dual(value, seeded == name ? 1.0 : 0.0);
    };
    const Dual M = dual("mass", m), D = dual("damping", d), K = dual("stiffness", k),
               X = dual("x", x), V = dual("v", v);
    const Dual g = D / (Dual(2.0) * M), w = sqrt(K / M - g * g), t(T), B = (V + g * X) / w;
    const Dual decay = exp(-(g * t)), C = cos(w * t), S = sin(w * t);
    const Dual place = decay * (X * C + B * S);
    return {place, decay * (w * (B * C - X * S)) - g * place};
  }
};

TEST_F(SensitivityOfScenes, OfASpringIsItsClosedForm) {
  const Oscillator o;
  const Numbers n{{"block.mass", o.m},
                  {"block.inertia.xx", 1},
                  {"block.inertia.yy", 1},
                  {"block.inertia.zz", 1},
                  {"slide.damping", o.d}};
  const Scene s = scene_of(
      "<robot name=\"r\"><link name=\"ground\"/>" + link(n, "block", "0 0 0") +
          joint(n, "slide", "prismatic", "ground", "block", "1 0 0", "0 0 0") + "</robot>",
      fmt::format("[model]\nurdf = \"model.urdf\"\nbase = \"fixed\"\n[initial]\njoints.slide = {{ "
                  "position = {}, velocity = {} }}\n[integrator]\nmethod = \"gauss16\"\nstep = "
                  "0.25\n[run]\nduration = {}\n[[element]]\ntype = \"spring\"\njoint = "
                  "\"slide\"\nname = \"coil\"\nstiffness = {}\n",
                  o.x, o.v, o.T, o.k));
  const auto r = end_sensitivity(
      s, {.of = {"slide.position", "slide.velocity", "energy"}, .uncertainty = 0.1});
  ASSERT_EQ(r.failure, "");
  const std::map<std::string, std::pair<std::string, double>> known{
      {"block.mass", {"mass", 1}},
      {"slide.damping", {"damping", 1}},
      {"coil.factor", {"stiffness", o.k}},  // the slope by a factor is that by k times k
      {"slide.position", {"x", 1}},
      {"slide.velocity", {"v", 1}}};
  double worst = 0;
  int found = 0;
  for (size_t i = 0; i < r.inputs.size(); ++i) {
    const auto at = known.find(r.inputs[i].name);
    if (at == known.end()) continue;
    ++found;
    const auto [name, factor] = at->second;
    const auto [place, rate] = o.end(name);
    // H = m v²/2 + k x²/2
    const double energy = o.m * rate.v * rate.d + o.k * place.v * place.d +
                          (name == "mass" ? rate.v * rate.v / 2 : 0) +
                          (name == "stiffness" ? place.v * place.v / 2 : 0);
    const double expected[] = {place.d * factor, rate.d * factor, energy * factor};
    for (size_t q = 0; q < 3; ++q)
      worst = std::max(worst, std::fabs(r.of[q].slopes[i] - expected[q]));
  }
  EXPECT_EQ(found, 5);
  // The method's own error: gauss16 at w h = 0.4 is at rounding. Slopes are of order 1, 100 steps
  // of roundings.
  std::printf("  slopes of place, rate and energy off by %.1e   bound 1e-13\n", worst);
  EXPECT_LT(worst, 1e-13);
  EXPECT_NEAR(r.of[0].value, o.end("").first.v, 1e-14);
  double square = 0;
  for (size_t i = 0; i < r.inputs.size(); ++i)
    if (!r.inputs[i].start) square += std::pow(r.of[0].slopes[i] * r.inputs[i].value, 2);
  EXPECT_DOUBLE_EQ(r.deviation(r.of[0]), 0.1 * std::sqrt(square));
}

// --- whole runs ----------------------------------------------------------------------------------

/// An arm of two links on a body, and every number of it that an input names.
Numbers arm_numbers() {
  return {{"bus.mass", 20},
          {"bus.com.x", 0.05},
          {"bus.com.y", -0.1},
          {"bus.com.z", 0.2},
          {"bus.inertia.xx", 3},
          {"bus.inertia.yy", 2.6},
          {"bus.inertia.zz", 2.2},
          {"bus.inertia.xy", 0.1},
          {"bus.inertia.xz", -0.2},
          {"bus.inertia.yz", 0.15},
          {"upper.mass", 4},
          {"upper.com.x", 0.03},
          {"upper.com.y", 0.02},
          {"upper.com.z", 0.4},
          {"upper.inertia.xx", 0.4},
          {"upper.inertia.yy", 0.38},
          {"upper.inertia.zz", 0.3},
          {"upper.inertia.xy", 0.02},
          {"upper.inertia.xz", 0.01},
          {"upper.inertia.yz", -0.02},
          {"lower.mass", 3},
          {"lower.com.x", -0.02},
          {"lower.com.y", 0.04},
          {"lower.com.z", 0.3},
          {"lower.inertia.xx", 0.3},
          {"lower.inertia.yy", 0.28},
          {"lower.inertia.zz", 0.25},
          {"lower.inertia.xy", 0.01},
          {"lower.inertia.xz", -0.02},
          {"lower.inertia.yz", 0.01},
          {"shoulder.damping", 0.2},
          {"elbow.damping", 0.1},
          {"shoulder.position", 0.5},
          {"shoulder.velocity", -0.4},
          {"elbow.position", -0.8},
          {"elbow.velocity", 0.7},
          {"coil.factor", 1},
          {"base.position.x", 1},
          {"base.position.y", -2},
          {"base.position.z", 0.5},
          {"base.linear_velocity.x", 0.1},
          {"base.linear_velocity.y", -0.2},
          {"base.linear_velocity.z", 0.3},
          {"base.angular_velocity.x", 0.2},
          {"base.angular_velocity.y", -0.1},
          {"base.angular_velocity.z", 0.15},
          {"base.attitude.x", 0},
          {"base.attitude.y", 0},
          {"base.attitude.z", 0}};
}

/// With numbers of the inputs in place of the arm's own.
class SensitivityOfArms : public SensitivityOfScenes {
 protected:
  Scene arm(const Numbers& n, bool floats) const {
    const std::string urdf =
        "<robot name=\"arm\">" + std::string(floats ? "" : "<link name=\"ground\"/>") +
        link(n, "bus", "0.3 -0.2 0.5") + link(n, "upper", "0.1 0.2 -0.3") +
        link(n, "lower", "0 0 0") +
        (floats ? "" : joint(n, "turntable", "fixed", "ground", "bus", "0 0 1", "0 0 0")) +
        joint(n, "shoulder", "continuous", "bus", "upper", "1 0.2 0", "0 0.1 0.3") +
        joint(n, "elbow", "continuous", "upper", "lower", "0.3 1 0", "0 0 0.8") + "</robot>";
    const auto at = [&](const std::string& name) { return number(n, name); };
    // ξ ∘ exp(δ/2)
    const mechanics::Quaternion<double> xi{std::sqrt(0.5), {0.1, std::sqrt(0.5 - 0.05), 0.2}},
        turn{1, {at("base.attitude.x") / 2, at("base.attitude.y") / 2, at("base.attitude.z") / 2}};
    const auto a = xi * turn;
    std::string text = fmt::format(
        "[model]\nurdf = \"model.urdf\"\nbase = \"{}\"\n[environment]\ngravity = \"uniform\"\n"
        "vector = [0.3, 0, -9.81]\n[initial]\n"
        "joints.shoulder = {{ position = {:.17g}, velocity = {:.17g} }}\n"
        "joints.elbow = {{ position = {:.17g}, velocity = {:.17g} }}\n",
        floats ? "free" : "fixed", at("shoulder.position"), at("shoulder.velocity"),
        at("elbow.position"), at("elbow.velocity"));
    if (floats)
      text += fmt::format(
          "base = {{ position = [{:.17g}, {:.17g}, {:.17g}], attitude_wxyz = [{:.17g}, {:.17g}, "
          "{:.17g}, {:.17g}], linear_velocity = [{:.17g}, {:.17g}, {:.17g}], angular_velocity = "
          "[{:.17g}, {:.17g}, {:.17g}] }}\n",
          at("base.position.x"), at("base.position.y"), at("base.position.z"), a.w, a.v.x, a.v.y,
          a.v.z, at("base.linear_velocity.x"), at("base.linear_velocity.y"),
          at("base.linear_velocity.z"), at("base.angular_velocity.x"),
          at("base.angular_velocity.y"), at("base.angular_velocity.z"));
    text += fmt::format(
        "[integrator]\nmethod = \"gauss16\"\nstep = 0.125\n[run]\nduration = {}\n"
        "[[element]]\ntype = \"spring\"\njoint = \"elbow\"\nname = \"coil\"\nstiffness = {:.17g}\n"
        "cubic = {:.17g}\nrest = 0.2\n",
        floats ? "2.94" : "3",  // with a shorter last step
        6 * at("coil.factor"), 2 * at("coil.factor"));
    text +=
        "[[output]]\nname = \"tip\"\nquantity = \"position\"\nlink = \"lower\"\nat = [0, 0, 0.7]\n"
        "[[output]]\nname = \"speed\"\nquantity = \"velocity\"\nlink = \"lower\"\n"
        "[[output]]\nname = \"reach\"\nquantity = \"formula\"\n"
        "formula = \"sqrt(tip.x^2 + tip.y^2) + speed.z\"\n"
        "[[output]]\nname = \"rest\"\nquantity = \"angle\"\nlink = \"lower\"\n";
    return scene_of(urdf, text);
  }

  /// The end of a whole run as porthos run takes it, with the centre of mass taken out.
  Numbers whole_run(const Scene& s) const {
    const Assembly a = assemble(s);
    const auto method = make_integrator(a, s.method, s.step);
    phs::State state = a.initial;
    const Steps n = steps_of(s);
    for (int k = 0; k < n.total; ++k)
      EXPECT_TRUE((n.ends_short(k) ? method->step_by(state, n.last) : method->step(state)) ==
                  integrators::Outcome::ok);
    Outputs outputs(s, a);
    const auto values = outputs.at(s.duration, state, {});
    Numbers end;
    size_t at = 0;
    for (const auto& name : number_names(s.outputs)) end[name] = values[at++];
    WorldView view(a);
    Assembly stays = a;
    stays.centre.reset();
    const phs::State world = view(s.duration, state);
    for (const auto& q : EndQuantities(s, stays).at(s.duration, world, motion_, {}))
      end[q.name] = q.value;
    return end;
  }
  std::vector<std::string> motion_;  ///< asked about besides the outputs
};

/// Of the end of a run of 24 steps, relative: it turns small changes into larger ones.
constexpr double rounding = 1e-14;

struct Worst {
  double off = 0, told = 0;  ///< of slopes, and what the differences say of themselves
  std::string where;
};

/// Every input that the arm's text can change, against differences of whole runs.
TEST_F(SensitivityOfArms, IsThatOfWholeRuns) {
  for (const bool floats : {false, true}) {
    const Numbers n = arm_numbers();
    motion_ = {"shoulder.position", "elbow.velocity"};
    if (floats)
      for (const char* what :
           {"position.x", "position.z", "attitude.y", "linear_velocity.x", "angular_velocity.z"})
        motion_.push_back(std::string("base.") + what);
    std::vector<std::string> of{"tip.x", "tip.z", "speed.y", "reach", "rest"};
    of.insert(of.end(), motion_.begin(), motion_.end());
    const Scene s = arm(n, floats);
    const auto r = end_sensitivity(s, {.of = of});
    ASSERT_EQ(r.failure, "");
    const Numbers here = whole_run(s);
    double value_off = 0;
    for (const auto& q : r.of)
      value_off = std::max(value_off, std::fabs(q.value - here.at(q.name)));

    Worst worst;
    int compared = 0;
    std::vector<double> slopes(of.size());
    for (size_t i = 0; i < r.inputs.size(); ++i) {
      const std::string& name = r.inputs[i].name;
      if (!n.contains(name)) continue;  // not in a URDF: rotors, springs of joints
      ++compared;
      const auto run = [&](double d) {
        Numbers changed = n;
        changed[name] += d;
        const Numbers end = whole_run(arm(changed, floats));
        for (size_t q = 0; q < of.size(); ++q) slopes[q] = end.at(of[q]);
        return std::span<const double>(slopes);
      };
      const double size = std::fabs(n.at(name));
      const auto differences = ridders(run, of.size(), size > 0 ? size / 16 : 1.0 / 16, rounding);
      for (size_t q = 0; q < of.size(); ++q) {
        const double scale = 1 + std::fabs(differences.slope[q]);
        // As far as the differences can tell, with what a sum of two errors may hide.
        EXPECT_LT(std::fabs(r.of[q].slopes[i] - differences.slope[q]), 2 * differences.error[q])
            << of[q] << " by " << name;
        const double off = std::fabs(r.of[q].slopes[i] - differences.slope[q]) / scale;
        if (off > worst.off) worst = {off, differences.error[q] / scale, of[q] + " by " + name};
        EXPECT_LT(off, 1e-9) << of[q] << " by " << name << ": " << r.of[q].slopes[i] << " and "
                             << differences.slope[q];
      }
    }
    std::printf(
        "  %s: %d inputs, off by %.1e of 1 + slope (%s; differences say %.1e)   bound 1e-9\n"
        "    values off those of the run by %.1e   bound 1e-11\n",
        floats ? "floating" : "standing", compared, worst.off, worst.where.c_str(), worst.told,
        value_off);
    EXPECT_EQ(compared, floats ? 49 : 27);
    EXPECT_LT(value_off, 1e-11);
    for (const auto& q : r.of) EXPECT_LT(q.error, 1e-11) << q.name;
  }
}

/// Control: slopes at fixed momenta, which a start in rates does not keep, are others.
TEST_F(SensitivityOfArms, AtFixedMomentaItWouldBeAnother) {
  Scene s = arm(arm_numbers(), false);
  s.centre_stays = true;
  const Assembly a = assemble(s);
  const EndQuantities quantities(s, a);
  std::vector<std::string> names;
  std::vector<EndQuantity> found;
  const auto g = integrators::gradient_of_run(
      s.method, *a.model, a.initial, s.step, 24,
      {.end =
           [&](double t, std::span<const double> x, std::span<double> gradient) {
             phs::State state(a.model->description(), {x.begin(), x.end()});
             found = quantities.at(t, state, {"elbow.velocity"}, names);
             std::ranges::copy(found[0].by_state, gradient.begin());
             return found[0].value;
           },
       .sampled = {},
       .running = {}});
  ASSERT_EQ(g.outcome, integrators::Outcome::ok);
  const auto r = end_sensitivity(s, {.of = {"elbow.velocity"}});
  const std::string name = "lower.inertia.xx";  // its axes are the link's
  const auto at = [&](const auto& list, const auto& proj) {
    return size_t(std::ranges::find(list, name, proj) - list.begin());
  };
  const double mine = r.of[0].slopes[at(r.inputs, &Input::name)];
  const double control = g.parameters[at(g.names, std::identity())];
  std::printf("  %.6f at fixed rates, %.6f at fixed momenta\n", mine, control);
  EXPECT_GT(std::fabs(mine - control), 0.01 * std::fabs(mine));
}

TEST_F(SensitivityOfArms, EnergyIsThatOfWholeRuns) {
  const Numbers n = arm_numbers();
  const auto r = end_sensitivity(arm(n, false), {.of = {"energy"}});
  double worst = 0;
  for (size_t i = 0; i < r.inputs.size(); ++i) {
    const std::string& name = r.inputs[i].name;
    if (!n.contains(name)) continue;
    double energy = 0;
    const auto run = [&](double d) {
      Numbers changed = n;
      changed[name] += d;
      const Scene s = arm(changed, false);
      const Assembly a = assemble(s);
      const auto method = make_integrator(a, s.method, s.step);
      phs::State state = a.initial;
      for (int k = 0; k < 24; ++k) EXPECT_EQ(method->step(state), integrators::Outcome::ok);
      const auto x = phs::with_turns(a.model->description(), state);
      energy = a.model->instantiate<double>()->hamiltonian(x);
      return std::span<const double>(&energy, 1);
    };
    const auto d = ridders(run, 1, std::max(0.01, std::fabs(n.at(name))) / 16, rounding);
    worst =
        std::max(worst, std::fabs(r.of[0].slopes[i] - d.slope[0]) / (1 + std::fabs(d.slope[0])));
  }
  std::printf("  off by %.1e of 1 + slope   bound 1e-9\n", worst);
  EXPECT_LT(worst, 1e-9);
}

// --- differences ---------------------------------------------------------------------------------

TEST(Ridders, TellsItsError) {
  double values[2];
  const auto d = ridders(
      [&](double h) {
        values[0] = std::exp(1 + h);
        values[1] = std::fabs(h - 0.01);  // a kink near by
        return std::span<const double>(values);
      },
      2, 0.25);
  const double off = std::fabs(d.slope[0] - std::exp(1.0));
  std::printf("  exp: off by %.1e, says %.1e;  beside a kink: off by %.1e, says %.1e\n", off,
              d.error[0], std::fabs(d.slope[1] + 1), d.error[1]);
  EXPECT_LT(off, 1e-12);
  EXPECT_LE(off, d.error[0]);
  EXPECT_LT(d.error[0], 1e-11);
  EXPECT_NEAR(d.slope[1], -1, 1e-12);  // its last levels lie on one side
}

// --- results and refusals ------------------------------------------------------------------------

TEST_F(SensitivityOfArms, IsWrittenAsTextJsonAndTable) {
  Scene s = arm(arm_numbers(), true);
  s.title = "Arm";
  const auto r = end_sensitivity(s, {.of = {}, .uncertainty = 0.01});
  EXPECT_EQ(r.of.size(), 8U) << "the outputs by default";
  const std::string text = sensitivity_text(r, 2), csv = sensitivity_csv(r);
  for (const char* part :
       {"Arm: gauss16, 23 steps of 0.125 s and one of 0.065 s, 2.94 s simulated\n",
        "tip.x = ", "growth of the gradient ", "standard deviation ", " more\n"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  EXPECT_EQ(std::ranges::count(csv, '\n'), std::ptrdiff_t(1 + r.of.size() * r.inputs.size()));
  EXPECT_NE(csv.find("tip.x,m,base.attitude.x,start,rad,,"), std::string::npos);
  // NaN, of turns, is null
  EXPECT_NE(sensitivity_json(s, r).find("\"value\": null"), std::string::npos);
  write_sensitivity((folder_ / "out").string(), s, r);
  for (const char* file :
       {"sensitivity.json", "sensitivity.csv", "sensitivity.txt", "sensitivity.svg"})
    EXPECT_TRUE(fs::exists(folder_ / "out" / file)) << file;
}

TEST_F(SensitivityOfArms, WhatHasNoSlopesIsRefusedByOneSentence) {
  const Scene s = arm(arm_numbers(), false);
  const auto refused = [&](const Scene& scene, SensitivityRequest request = {}) {
    const auto text = refusal([&] { (void)end_sensitivity(scene, request); });
    return text.substr(0, text.find("; --by "));
  };
  EXPECT_EQ(refused(s, {.of = {"tip.w"}}).substr(0, 52),
            "scene.toml: there is no 'tip.w' at the end of a run,");
  EXPECT_EQ(refused(s, {.of = {}, .uncertainty = -1}),
            "uncertainty is -1, expected a positive number, relative to each parameter: 0.01 for "
            "1 %");
  Scene other = s;
  other.method = "spark8";
  EXPECT_NE(refused(other).find("not for 'spark8'"), std::string::npos);
  other.method = "gonzalez";  // and the joints are damped
  const auto by_start = end_sensitivity(other, {.of = {"elbow.position"}});
  EXPECT_NE(by_start.notes.at(0).find("by parameters of runs of gonzalez"), std::string::npos);
  const auto takes = [](const std::string& what) { return "scene.toml: a gradient takes " + what; };
  const auto with = [&](const std::string& more) { return read(s.text + more); };
  EXPECT_EQ(refused(with("[[stop]]\noutput = \"tip.z\"\nabove = 3\n")),
            takes("no [[stop]], which ends a run where its state says"));
  const std::string stop =
      "[[element]]\ntype = \"joint_stop\"\njoint = \"shoulder\"\nlower = "
      "-2\nupper = 2\nlaw = ";
  EXPECT_EQ(refused(with(stop + "\"rigid\"\nrestitution = 0.5\n")),
            takes("no rigid contact, rigid joint stop or dry friction: they jump"));
  EXPECT_EQ(refused(with(stop + "\"power\"\nstiffness = 100\nexponent = 2\nloss = 0\n")),
            takes("no contact and no joint stop that begins with a kink, expected law = "
                  "\"smooth\""));
  EXPECT_EQ(refused(with("[monitor]\nlimit = 1e-9\nstep_limit = 1e-9\naction = \"repeat\"\n")),
            takes("no [monitor] that repeats or projects steps"));
  const Scene momentum = with("[[output]]\nname = \"push\"\nquantity = \"momentum\"\n");
  EXPECT_EQ(refused(momentum, {.of = {"push.x"}}).substr(0, 14), "scene.toml:39:");
  const auto r = end_sensitivity(momentum, {});
  ASSERT_EQ(r.notes.size(), 1U);
  EXPECT_EQ(r.notes[0],
            "output 'push' has no slopes: it depends on the parameters by more than places and "
            "rates");
}

/// What the examples have that has no slopes.
TEST(Sensitivity, RefusesExamplesByWhatTheyHave) {
  for (const auto& [example, words] : {std::pair{"ets_vii_orbit", "no [orbit]"},
                                       {"two_arms", "no [[event]] that closes or opens a loop"},
                                       {"newton_cradle", "no rigid contact"},
                                       {"dry_joints", "dry friction: they jump"},
                                       {"vsa_throw", "no [[actuator]]"},
                                       {"four_bar", "no constraints: loops"}}) {
    const Scene s =
        read_scene(fmt::format("{}/examples/{}/scene.toml", PORTHOS_SOURCE_DIR, example));
    try {
      (void)end_sensitivity(s, {});
      ADD_FAILURE() << example;
    } catch (const InvalidArgument& e) {
      EXPECT_NE(std::string(e.what()).find(words), std::string::npos)
          << example << ": " << e.what();
    }
  }
  Scene loops = read_scene(std::string(PORTHOS_SOURCE_DIR) + "/examples/four_bar/scene.toml");
  loops.method = "gauss8";
  try {
    (void)end_sensitivity(loops, {});
    ADD_FAILURE() << "loops";
  } catch (const InvalidArgument& e) {
    EXPECT_NE(std::string(e.what()).find("constraint"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace porthos::scene::sensitivity_test
