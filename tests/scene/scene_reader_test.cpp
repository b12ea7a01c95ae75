#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tests/scene/scene_files.h"

namespace porthos::scene::scene_reader_test {
namespace {

using SceneReader = SceneFiles;

TEST_F(SceneReader, EveryKeyArrives) {
  const Scene s = read(full_scene);
  EXPECT_EQ(s.text, full_scene);
  EXPECT_EQ(s.title, "Everything");
  EXPECT_EQ(clean(s.urdf_path), "arm.urdf");
  EXPECT_EQ(s.urdf_text, arm_urdf);
  EXPECT_EQ(s.urdf.base, mechanics::UrdfOptions::Base::free);
  EXPECT_EQ(s.urdf.links_without_inertia, mechanics::UrdfOptions::NoInertia::massless);
  EXPECT_FALSE(s.urdf.use_damping);
  ASSERT_EQ(s.urdf.link_inertia.count("lower"), 1u);
  const auto& m = s.urdf.link_inertia.at("lower");
  EXPECT_EQ(m.mass, 2);
  EXPECT_EQ(m.com.x, 0.1);
  EXPECT_EQ(m.com.y, 0);
  EXPECT_EQ(m.com.z, 0.2);
  EXPECT_EQ(m.inertia.xx, 1);
  EXPECT_EQ(m.inertia.yy, 2);
  EXPECT_EQ(m.inertia.zz, 2.5);
  EXPECT_EQ(m.inertia.xy, 0.1);
  EXPECT_EQ(m.inertia.xz, 0.2);
  EXPECT_EQ(m.inertia.yz, 0.3);
  EXPECT_EQ(s.urdf.gravity.x, 0);
  EXPECT_EQ(s.urdf.gravity.y, 0.5);
  EXPECT_EQ(s.urdf.gravity.z, -9.81);

  EXPECT_EQ(s.base.position.x, 1);
  EXPECT_EQ(s.base.position.z, 3);
  EXPECT_EQ(s.base.linear_velocity.x, 4);
  EXPECT_EQ(s.base.linear_velocity.z, 6);
  EXPECT_EQ(s.base.angular_velocity.x, 7);
  EXPECT_EQ(s.base.angular_velocity.z, 9);
  EXPECT_EQ(clean(s.base.where), "scene.toml:12:1");
  EXPECT_EQ(s.joints.at("shoulder").position, 0.3);
  EXPECT_EQ(s.joints.at("shoulder").velocity, -0.05);
  EXPECT_EQ(clean(s.joints.at("shoulder").where), "scene.toml:13:8");
  ASSERT_TRUE(s.random);
  EXPECT_EQ(s.random->seed, 7u);
  EXPECT_EQ(s.random->joint_position, 0.5);
  EXPECT_EQ(s.random->joint_velocity, 0.25);

  EXPECT_EQ(s.method, "gauss8");
  EXPECT_EQ(s.step, 0.25);
  EXPECT_EQ(s.rtol, 1e-10);
  EXPECT_EQ(s.step_control, integrators::StepControl::reversible);
  EXPECT_EQ(s.control_rate, 2);
  EXPECT_EQ(s.control_length, 0.5);
  EXPECT_EQ(s.duration, 1000);
  EXPECT_EQ(s.record_every, 2);
  EXPECT_EQ(s.checkpoint_every, 30);
  EXPECT_EQ(s.verify.energy, 1e-12);
  EXPECT_EQ(s.verify.linear_momentum, 1e-13);
  EXPECT_EQ(s.verify.angular_momentum, 2e-13);
  EXPECT_EQ(s.verify.quaternion_norm, 3e-13);
  EXPECT_EQ(s.verify.balance, 4e-13);
  EXPECT_EQ(s.verify.symmetry, 0);
}

TEST_F(SceneReader, AttitudeIsNormalised) {
  const Scene s = read(full_scene);  // (0, 3, 0, 4)
  EXPECT_EQ(s.base.attitude_wxyz[0], 0);
  EXPECT_DOUBLE_EQ(s.base.attitude_wxyz[1], 0.6);
  EXPECT_DOUBLE_EQ(s.base.attitude_wxyz[3], 0.8);
  // Squares of these would vanish or overflow.
  for (const std::string size : {"1e-300", "1e300"}) {
    Lines l;
    l.initial = "base.attitude_wxyz = [" + size + ", 0, 0, -" + size + "]\n";
    const Scene t = read(l);
    EXPECT_DOUBLE_EQ(t.base.attitude_wxyz[0], std::sqrt(0.5));
    EXPECT_DOUBLE_EQ(t.base.attitude_wxyz[3], -std::sqrt(0.5));
  }
}

TEST_F(SceneReader, DefaultsApplyWhereNothingIsSaid) {
  const Scene s = read(
      "[model]\nurdf = \"arm.urdf\"\nbase = \"fixed\"\n[integrator]\nstep = 0.3\n[run]\nduration = "
      "1000");
  EXPECT_EQ(s.title, "scene");
  EXPECT_EQ(s.method, "gauss16");
  EXPECT_TRUE(s.urdf.use_damping);
  EXPECT_EQ(s.urdf.links_without_inertia, mechanics::UrdfOptions::NoInertia::error);
  EXPECT_EQ(s.urdf.gravity.z, 0);
  EXPECT_TRUE(s.base.where.empty());
  EXPECT_FALSE(s.random);
  EXPECT_DOUBLE_EQ(s.record_every, 0.9);  // 1000 s / 1000, in whole steps
  EXPECT_EQ(s.checkpoint_every, 60);
  EXPECT_EQ(s.verify.energy, 1e-9);
  EXPECT_EQ(s.verify.linear_momentum, 1e-10);
  EXPECT_EQ(s.verify.angular_momentum, 1e-10);
  EXPECT_EQ(s.verify.quaternion_norm, 1e-12);
  EXPECT_FALSE(s.verify.balance);
  EXPECT_FALSE(s.verify.symmetry);
}

TEST_F(SceneReader, AnEmptyVerifyTableHasTheDefaults) {
  Lines l;
  l.rest = "[verify]";
  const Limits v = read(l).verify, none = default_limits(false);
  EXPECT_TRUE(none.energy);
  EXPECT_EQ(v.energy, none.energy);
  EXPECT_EQ(v.linear_momentum, none.linear_momentum);
  EXPECT_EQ(v.angular_momentum, none.angular_momentum);
  EXPECT_EQ(v.quaternion_norm, none.quaternion_norm);
}

TEST_F(SceneReader, FilesThatCannotBeOpened) {
  EXPECT_EQ(refusal([&] { read_scene((folder_ / "absent.toml").string()); }),
            "scene file 'absent.toml' cannot be opened: No such file or directory");
  fs::create_directories(folder_ / "sub");
  EXPECT_EQ(refusal([&] { read_scene((folder_ / "sub").string()); }),
            "scene file 'sub' cannot be opened: it is a directory");
  Lines l;
  l.model = "base = \"free\"\nurdf = \"absent.urdf\"";
  EXPECT_EQ(error(l),
            "scene.toml:3:8: URDF file 'absent.urdf' cannot be opened: No such file or directory");
}

TEST_F(SceneReader, BrokenToml) {
  EXPECT_EQ(error("title = \"a\"\n[model\n"),
            "scene.toml:2:7: broken TOML while parsing table header: expected ']', saw '\\n'");
  EXPECT_EQ(error("title = \"a\"\ntitle = \"b\"\n"),
            "scene.toml:2:9: broken TOML while parsing key-value pair: cannot redefine existing "
            "string 'title'");
  EXPECT_EQ(error("[model]\nbase = fixed\n"),
            "scene.toml:2:9: broken TOML while parsing boolean: expected 'false', saw 'fi'; a text "
            "stands in quotes, as in \"fixed\"");
}

struct Refusal {
  Lines scene;
  std::string text;
};

TEST_F(SceneReader, RefusalsSayWhereWhatAndWhatWasExpected) {
  const auto model = [](std::string t) {
    Lines l;
    l.model = std::move(t);
    return l;
  };
  const auto initial = [](std::string t) {
    Lines l;
    l.initial = std::move(t) + "\n";
    return l;
  };
  const auto integrator = [](std::string t) {
    Lines l;
    l.integrator = std::move(t);
    return l;
  };
  const auto run = [](std::string t) {
    Lines l;
    l.run = std::move(t);
    return l;
  };
  const auto rest = [](std::string t) {
    Lines l;
    l.rest = std::move(t);
    return l;
  };
  const std::string urdf = "urdf = \"arm.urdf\"\n", fixed = "base = \"fixed\"\n";
  const std::vector<Refusal> refusals = {
      // unknown keys and the nearest known one
      {rest("[verfiy]\nenergy = 1"),
       "12:2: unknown key 'verfiy' in the scene, the nearest known one is 'verify' "
       "(known: title, model, environment, initial, robot, body, panel, element, controller, "
       "actuator, "
       "loop, "
       "coupling, rolling, motion, contact, event, output, stop, planet, orbit, integrator, "
       "monitor, run, "
       "verify, "
       "ensemble, plan)"},
      {model("udrf = \"arm.urdf\"\n" + fixed),
       "2:1: unknown key 'udrf' in [model], the nearest known one is 'urdf' "
       "(known: urdf, base, lock, links_without_inertia, unphysical_inertia, use_damping, "
       "use_friction, mimic, coordinates, inertia, mass_factor)"},
      {run("durations = 10"),
       "11:1: unknown key 'durations' in [run], the nearest known one is 'duration' "
       "(known: duration, record_every, extrema, low_words, checkpoint_every, case)"},
      {integrator("stp = 1"),
       "8:1: unknown key 'stp' in [integrator], the nearest known one is 'step' "
       "(known: method, step, target_energy_error, rtol, iteration_tolerance, step_control, "
       "step_control_rate, "
       "step_control_length)"},
      {initial("joints.slide = { positon = 1 }"),
       "5:18: unknown key 'positon' in joints.slide, the nearest known one "
       "is 'position' (known: position, velocity, attitude_wxyz, linear_velocity, "
       "angular_velocity)"},
      {initial("base = { pos = [0, 0, 0] }"),
       "5:10: unknown key 'pos' in base, the nearest known one is 'position' "
       "(known: position, attitude_wxyz, linear_velocity, angular_velocity)"},
      {rest("[environment]\ngravty = 1"),
       "13:1: unknown key 'gravty' in [environment], the nearest known one is 'gravity' (known: "
       "gravity, vector, magnetic_field)"},
      // missing keys
      {model("base = \"free\""),
       "1:1: [model] lacks the key 'urdf', expected the name of a URDF file"},
      {model(urdf), "1:1: [model] lacks the key 'base', expected \"free\" or \"fixed\""},
      {integrator(""), "7:1: [integrator] lacks the key 'step', expected a number of seconds"},
      {run(""), "10:1: [run] lacks the key 'duration', expected a number of seconds"},
      {model(urdf + fixed + "inertia.lower = { com = [0, 0, 0] }"),
       "4:17: inertia.lower lacks the key 'mass', expected a number of kg"},
      {rest("[environment]\ngravity = \"uniform\""),
       "12:1: [environment] lacks the key 'vector', expected 3 numbers of m/s^2, because gravity "
       "is "
       "\"uniform\""},
      // wrong types
      {model("urdf = 3\n" + fixed), "2:8: urdf is a number, expected the name of a URDF file"},
      {model("urdf = \"\"\n" + fixed), "2:8: urdf is empty, expected the name of a URDF file"},
      {model(urdf + "base = true"), "3:8: base is a boolean, expected \"free\" or \"fixed\""},
      {model(urdf + "base = \"fre\""), "3:8: base is \"fre\", expected \"free\" or \"fixed\""},
      {model(urdf + fixed + "links_without_inertia = \"skip\""),
       "4:25: links_without_inertia is \"skip\", expected \"error\" or \"massless\""},
      {model(urdf + fixed + "use_damping = 1"),
       "4:15: use_damping is a number, expected true or false"},
      {model(urdf + fixed + "inertia = 1"),
       "4:11: inertia is a number, expected a table of tables by name"},
      {model(urdf + fixed + "inertia.lower = { mass = \"1 kg\" }"),
       "4:26: inertia.lower.mass is a string, expected a number of kg"},
      {model(urdf + fixed + "inertia.lower = { mass = -1 }"),
       "4:26: inertia.lower.mass is -1, expected a number of kg, 0 or more"},
      {model(urdf + fixed + "inertia.lower = { mass = 1, inertia = [1, 1, 1] }"),
       "4:39: inertia.lower.inertia has 3 entries, expected 6 numbers of kg m^2 (ixx, iyy, izz, "
       "ixy, ixz, iyz)"},
      {integrator("step = \"0.1 s\""), "8:8: step is a string, expected a number of seconds"},
      {integrator("step = 1979-05-27"), "8:8: step is a date, expected a number of seconds"},
      {integrator("step = 07:32:00"), "8:8: step is a time of day, expected a number of seconds"},
      {integrator("step = [0.1]"), "8:8: step is an array, expected a number of seconds"},
      {integrator("step = { s = 1 }"), "8:8: step is a table, expected a number of seconds"},
      {integrator("method = 4\nstep = 1"),
       "8:10: method is a number, expected the name of a method"},
      {initial("base = 0"),
       "5:8: base is a number, expected a table with the keys position, attitude_wxyz, "
       "linear_velocity, angular_velocity"},
      {initial("base.position = 1"),
       "5:17: base.position is a number, expected 3 numbers of metres"},
      {initial("base.position = [1, 2]"),
       "5:17: base.position has 2 entries, expected 3 numbers of metres"},
      {initial("base.linear_velocity = [0, 'x', 0]"),
       "5:28: base.linear_velocity[1] is a string, expected a number of m/s"},
      {initial("base.attitude_wxyz = [1, 0, 0]"),
       "5:22: base.attitude_wxyz has 3 entries, expected 4 numbers"},
      {initial("joints.slide = 0.3"),
       "5:16: joints.slide is a number, expected a table with the keys position, velocity, "
       "attitude_wxyz, linear_velocity, angular_velocity"},
      {initial("joints.slide.position = true"),
       "5:25: joints.slide.position is a boolean, expected a number of rad or m, or 3 numbers of "
       "metres"},
      {model(urdf + fixed + "lock = \"slide\""),
       "4:8: lock is a string, expected an array of names of joints"},
      {model(urdf + fixed + "lock = [\"slide\", 1]"), "4:18: lock[1] is a number, expected text"},
      {initial("joints.slide.velocity = true"),
       "5:25: joints.slide.velocity is a boolean, expected a number of rad/s or m/s"},
      {initial("random = { seed = 1.5 }"),
       "5:19: random.seed is 1.5, expected a whole number, 0 or more"},
      {initial("random = { seed = -1 }"),
       "5:19: random.seed is -1, expected a whole number, 0 or more"},
      {initial("random = { seed = \"a\" }"),
       "5:19: random.seed is a string, expected a whole number, 0 or more"},
      // values out of range
      {integrator("step = 0"), "8:8: step is 0 s, expected more than 0 s"},
      {integrator("step = -0.1"), "8:8: step is -0.1 s, expected more than 0 s"},
      {integrator("step = inf"), "8:8: step is inf, expected a finite number of seconds"},
      {integrator("step = nan"), "8:8: step is nan, expected a finite number of seconds"},
      {integrator("method = \"gaus16\"\nstep = 1"),
       "8:10: method is 'gaus16', expected 'gauss16' or another that porthos methods lists; one "
       "added by a program is known to that program alone"},
      {integrator("method = \"pylob\"\nstep = 1"),
       "8:10: method is 'pylob', expected one that porthos methods lists; one added by a program "
       "is known to that program alone"},
      {integrator("step = 1\niteration_tolerance = -1"),
       "9:23: iteration_tolerance is -1, expected 0 (iterate to rounding) or a number below 1"},
      {integrator("step = 1\nrtol = 0"), "9:8: rtol is 0, expected a number between 0 and 1"},
      {integrator("step = 1\nstep_control = 'adaptive'"),
       "9:16: step_control is \"adaptive\", expected \"fixed\" or \"time_transformed\" or "
       "\"reversible\""},
      {integrator("step = 1\nmethod = 'rk4'\nstep_control = 'reversible'"),
       "10:16: step_control is \"reversible\", but rk4 is not symmetric, expected a symmetric "
       "method"},
      {integrator("step = 1\nmethod = 'cvode_bdf'\nstep_control = 'time_transformed'"),
       "10:16: step_control is \"time_transformed\", but cvode_bdf chooses its steps itself, "
       "expected "
       "step_control = \"fixed\""},
      {integrator("step = 1\nmethod = 'auto'\nstep_control = 'reversible'"),
       "10:16: step_control is \"reversible\", but auto chooses a fixed step, expected "
       "step_control = \"fixed\""},
      {integrator("step = 1\nstep_control_rate = 2"),
       "9:21: step_control_rate is given without a step_control, expected both or neither"},
      {integrator("step = 1\nstep_control = 'reversible'\nstep_control_rate = 0"),
       "10:21: step_control_rate is 0, expected a number of rad/s above 0"},
      {run("duration = 0"), "11:12: duration is 0 s, expected more than 0 s"},
      {run("duration = 0.05"), "11:12: duration is 0.05 s, expected at least one step of 0.1 s"},
      {run("duration = 1e15"),
       "11:12: duration is 1000000000000000 s, 1e+16 steps of 0.1 s, expected at most 1e+15 steps"},
      {run("duration = 1\nrecord_every = 0"), "12:16: record_every is 0 s, expected more than 0 s"},
      {run("duration = 1\ncheckpoint_every = -1"),
       "12:20: checkpoint_every is -1 s, expected more than 0 s"},
      {initial("base.attitude_wxyz = [0, 0, 0, 0]"),
       "5:22: base.attitude_wxyz has length 0, expected a quaternion of length 1"},
      {initial("base.position = [0, inf, 0]"),
       "5:21: base.position[1] is inf, expected a finite number of metres"},
      {initial("random.joint_position = -1"),
       "5:25: random.joint_position is -1, expected a number of rad or m, 0 or more"},
      {rest("[verify]\nenergy = -1e-9"), "13:10: energy is -1e-09, expected a number, 0 or more"},
      {rest("[verify]\nsymmetry = \"yes\""), "13:12: symmetry is a string, expected a number"},
      {rest("[environment]\ngravity = \"central\""),
       "13:11: gravity \"central\" is not available yet: expected \"none\" or \"uniform\""},
      {rest("[environment]\ngravity = \"lunar\""),
       "13:11: gravity is \"lunar\", expected \"none\" or \"uniform\""},
      {rest("[environment]\ngravity = 9.81"),
       "13:11: gravity is a number, expected \"none\" or \"uniform\""},
      {rest("[environment]\nvector = [0, 0, 1]"),
       "13:10: vector is given without gravity = \"uniform\", expected both or neither"},
  };
  for (const auto& r : refusals) {
    EXPECT_EQ(error(r.scene), "scene.toml:" + r.text) << std::string(r.scene);
  }
}

TEST_F(SceneReader, MissingAndMistypedTables) {
  EXPECT_EQ(error(""),
            "scene.toml:1:1: there is no [model], expected a table with the keys urdf, base, lock, "
            "links_without_inertia, unphysical_inertia, use_damping, use_friction, mimic, "
            "coordinates, inertia, mass_factor");
  EXPECT_EQ(error("model = 1"),
            "scene.toml:1:9: model is a number, expected a table with the keys urdf, base, lock, "
            "links_without_inertia, unphysical_inertia, use_damping, use_friction, mimic, "
            "coordinates, inertia, mass_factor");
  EXPECT_EQ(error("title = 1"), "scene.toml:1:9: title is a number, expected text");
  const std::string model = "[model]\nurdf = \"arm.urdf\"\nbase = \"free\"\n";
  EXPECT_EQ(error(model),
            "scene.toml:1:1: there is no [integrator], expected a table with the keys method, "
            "step, target_energy_error, rtol, iteration_tolerance, step_control, "
            "step_control_rate, step_control_length");
  EXPECT_EQ(error(model + "[integrator]\nstep = 1"),
            "scene.toml:1:1: there is no [run], expected a table with the keys duration, "
            "record_every, extrema, low_words, checkpoint_every, case");
}

TEST_F(SceneReader, OverridesAreRefusedLikeKeys) {
  Scene s = read(Lines{});
  const auto refused = [&](const Overrides& o) { return refusal([&] { apply(s, o); }); };
  EXPECT_EQ(refused({{}, 0.0, {}}), "--step: step is 0 s, expected more than 0 s");
  EXPECT_EQ(refused({{}, {}, -1.0}), "--duration: duration is -1 s, expected more than 0 s");
  EXPECT_EQ(refused({{}, {}, std::numeric_limits<double>::infinity()}),
            "--duration: duration is inf, expected a finite number of seconds");
  EXPECT_EQ(refused({{}, 20.0, {}}),
            "--step: duration is 10 s, expected at least one step of 20 s");
  EXPECT_EQ(refused({{}, {}, 0.01}),
            "--duration: duration is 0.01 s, expected at least one step of 0.1 s");
  EXPECT_EQ(
      refused({"rk", {}, {}}),
      "--method: method is 'rk', expected 'rk4' or another that porthos methods lists; one added "
      "by a program is known to that program alone");
  EXPECT_EQ(s.step, 0.1) << "a refused override must change nothing";
  EXPECT_EQ(s.duration, 10);

  apply(s, {"rk4", 0.5, 2000.0});
  EXPECT_EQ(s.method, "rk4");
  EXPECT_EQ(s.step, 0.5);
  EXPECT_EQ(s.duration, 2000);
  EXPECT_EQ(s.record_every, 2) << "the default follows";

  Scene stated = read(full_scene);
  apply(stated, {{}, {}, 5000.0});
  EXPECT_EQ(stated.record_every, 2) << "a stated value stays";
}

}  // namespace
}  // namespace porthos::scene::scene_reader_test
