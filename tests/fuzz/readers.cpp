#include "tests/fuzz/readers.h"

#include "mechanics/urdf.h"
#include "phs/functions/formula.h"
#include "report/detail/mesh.h"
#include "report/report.h"
#include "scene/ensemble/case_log.h"
#include "scene/ensemble/ensemble_scene.h"
#include "scene/files/digest.h"
#include "scene/judge/judge_file.h"
#include "scene/read/joined.h"
#include "scene/run/checkpoint.h"
#include "scene/run/watched_run.h"
#include "scene/session/export.h"
#include "scene/session/replot.h"
#include "scene/session/report_reader.h"
#include "tests/fuzz/base.h"
#include "vsa/table.h"

namespace porthos::test::fuzz {
namespace {

using Seeds = std::vector<std::string>;

void read_urdf(const std::string& bytes) { (void)mechanics::parse_urdf(bytes, "model.urdf"); }
Seeds urdf_seeds() {
  return {arm_urdf("<dynamics damping='1'/><limit lower='-1' upper='1' effort='1' velocity='1'/>"),
          from_source("examples/four_bar/four_bar.urdf"),
          from_source("examples/lander/lander.urdf")};
}

// Read, not assembled: a scene may name a mechanism of any size.
void read_scene(const std::string& bytes) {
  (void)scene::read_scene(base().file("fuzzed.toml", bytes));
}
Seeds scene_seeds() {
  return {read_bytes(base() / "scene.toml"), from_source("examples/ets_vii_orbit/scene.toml"),
          from_source("examples/lander/scene.toml"), from_source("examples/four_bar/scene.toml"),
          from_source("examples/ensemble/scene.toml")};
}

void read_actuator_csv(const std::string& bytes) {
  (void)vsa::read_measurements(base().file("spring.csv", bytes));
}
void read_formula(const std::string& bytes) {
  const phs::Formula formula(bytes, {"phi", "sigma"});
  const double at[] = {0.3, -0.2};
  (void)formula.at(std::span<const double>(at));
}
Seeds formula_seeds() {
  return {"0.5*(5 + 20*sigma^2)*phi^2 + 3e0*phi^4", "cosh(pi*(phi - sigma))/2 - max(phi, -1)^-3"};
}
Seeds actuator_csv_seeds() {
  return {"# a spring\ndeflection,sigma,torque\n-1,0,-5\n0,0,0\n1,0,5\n",
          "deflection,sigma,torque,stiffness,sigma_effort\n-1,0,-5,5,1\n0,0,0,5,0\n1,0,5,5,1\n"
          "-1,1,-9,9,1\n0,1,0,9,0\n1,1,9,9,1\n"};
}

void read_ensemble_csv(const std::string& bytes) {
  base().file("cases.csv", bytes);
  scene::Scene s = base().arm().scene;
  s.text += "[ensemble]\ntable = 'cases.csv'\n";
  (void)scene::read_ensemble(s, base().arm().assembly);
}
Seeds ensemble_csv_seeds() {
  return {"initial.joints.elbow.velocity,initial.joints.shoulder.position\n0.1,0.2\n-1,2\n",
          "# one\nenvironment.vector[2]\n-9.81\n-1.62\n"};
}

void read_stl(const std::string& bytes) { (void)report::parse_mesh(bytes, "a.stl"); }
void read_obj(const std::string& bytes) { (void)report::parse_mesh(bytes, "a.obj"); }
void read_dae(const std::string& bytes) { (void)report::parse_mesh(bytes, "a.dae"); }
Seeds stl_seeds() {
  std::string binary(80, ' ');
  binary += std::string("\1\0\0\0", 4) + std::string(50, '@');
  return {
      "solid t\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 0 0\n"
      "endloop\nendfacet\nendsolid t\n",
      binary};
}
Seeds obj_seeds() { return {"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1/1 -1//2 2\n"}; }
Seeds dae_seeds() {
  return {
      "<COLLADA><asset><unit meter='0.01'/></asset><library_geometries><geometry id='g'><mesh>"
      "<source id='p'><float_array>0 0 0 1 0 0 0 1 0</float_array></source><vertices id='v'>"
      "<input semantic='POSITION' source='#p'/></vertices><polylist><input semantic='VERTEX' "
      "source='#v' offset='0'/><vcount>3</vcount><p>0 1 2</p></polylist></mesh></geometry>"
      "</library_geometries><library_visual_scenes><visual_scene><node id='n'><matrix>1 0 0 0 0 "
      "1 0 0 0 0 1 0 0 0 0 1</matrix><rotate>0 0 1 90</rotate><instance_geometry url='#g'/>"
      "</node></visual_scene></library_visual_scenes></COLLADA>"};
}

/// A table as the torque of a joint, smooth and held, and as a wrench.
void read_signal_csv(const std::string& bytes) {
  base().file("drive.csv", bytes);
  const std::string text = read_bytes(base() / "scene.toml");
  for (const char* element :
       {"type = 'force'\njoint = 'elbow'\nfile = { path = 'drive.csv', value = 'u' }\n",
        "type = 'force'\njoint = 'elbow'\n"
        "file = { path = 'drive.csv', value = 'u', between = 'held' }\n",
        "type = 'wrench'\nname = 'push'\nlink = 'lower'\nforce = { components = { path = "
        "'drive.csv', z = 'u' } "
        "}\n"})
    (void)scene::read_scene(base().file("driven.toml", text + "[[element]]\n" + element));
}
Seeds signal_csv_seeds() { return {"t,u\n0,1\n0.5,-1\n1,0\n", "u,t\n1e3,0\n-1,1\n"}; }

void judge(const std::string& bytes, const char* name, const std::string& map = "") {
  base().file(name, bytes);
  (void)scene::judge_file({.file = (base() / name).string(),
                           .model = (base() / "arm.urdf").string(),
                           .map = map,
                           .out = (base() / "judged").string()});
}
void read_trajectory_csv(const std::string& bytes) { judge(bytes, "trajectory.csv"); }
void read_trajectory_h5(const std::string& bytes) { judge(bytes, "trajectory.h5"); }
Seeds trajectory_csv_seeds() {
  std::string rows = "time,q.shoulder,q.elbow,v.shoulder,v.elbow\n";
  for (int i = 0; i < 6; ++i)
    rows += std::to_string(0.1 * i) + ",0.1,0.2," + std::to_string(0.01 * i) + ",0\n";
  return {rows, "t;q.shoulder;q.elbow\n0;0;0\n1;0;0\n2;0;0\n"};
}

void read_trajectory_map(const std::string& bytes) {
  judge(trajectory_csv_seeds()[0], "mapped.csv", base().file("map.toml", bytes));
}
Seeds trajectory_map_seeds() {
  return {
      "[model]\nbase = 'fixed'\n[columns]\ntime = 'time'\n[columns.q]\nshoulder = 'q.shoulder'\n"
      "elbow = 'q.elbow'\n[columns.v]\nshoulder = 'v.shoulder'\nelbow = 'v.elbow'\n"
      "[environment]\ngravity = 'uniform'\nvector = [0, 0, -9.81]\n[verify]\nenergy = 1e-6\n"};
}

/// The bytes are the content of state.bin; head and checksum, which no mutation would hit, fit.
void read_checkpoint(const std::string& bytes) {
  base().restore_stopped();
  const fs::path folder = base().stopped() / "checkpoint";
  fs::remove(folder / "state.old");
  std::string file = read_bytes(folder / "state.bin").substr(0, 16);
  const std::uint64_t length = bytes.size();
  file.append(reinterpret_cast<const char*>(&length), sizeof length);
  file += bytes;
  write_bytes(folder / "state.bin", file + scene::sha256(file));
  scene::Checkpoint c = scene::read_checkpoint(folder);
  // Forged numbers as far as they are used: three steps, and everything that is measured of them.
  scene::WatchedRun run(base().arm().scene, base().arm().assembly, {}, [](auto) {});
  run.restore(c);
  for (int i = 0; i < 3 && run.goes_on(); ++i) run.step();
  (void)run.report();
  auto options = into(base().stopped(), true);
  options.stop_at = c.state.step;
  scene::run(base().arm().scene, base().arm().assembly, options);
}
Seeds checkpoint_seeds() {
  const std::string file = base().kept("stopped/checkpoint/state.bin");
  return {file.substr(24, file.size() - 24 - 64)};
}

void read_records(const std::string& bytes) {
  base().restore_stopped();
  write_bytes(base().stopped() / "checkpoint" / "records.bin", bytes);
  (void)report::report_json(base().stopped());
  auto options = into(base().stopped(), true);
  options.stop_at = 5;
  scene::run(base().arm().scene, base().arm().assembly, options);
}
Seeds records_seeds() { return {base().kept("stopped/checkpoint/records.bin")}; }

scene::CaseLayout case_layout() {
  const std::shared_ptr<const phs::Model> models[] = {base().arm().assembly.model};
  return {2, scene::StateColumns(models), 1};
}
void read_cases(const std::string& bytes) {
  const scene::CaseLog log(base().file("cases.bin", bytes), case_layout(), {{"scene file", "a"}});
  log.each([](std::span<const double>, scene::CaseLog::Place) {});
}
Seeds case_seeds() {
  const auto layout = case_layout();
  fs::remove(base() / "cases.bin");
  {
    scene::CaseLog log(base() / "cases.bin", layout, {{"scene file", "a"}});
    std::vector<double> row(layout.size());
    for (int i = 0; i < 3; ++i) {
      row[0] = i;
      layout.seal(row);
      log.append(row);
    }
  }
  return {read_bytes(base() / "cases.bin")};
}

void read_joined(const std::string& bytes) { (void)scene::joined_of(bytes); }
Seeds joined_seeds() {
  scene::Joined joined;
  joined.holds = {{"target", "hand", {}, ""}, {"", "", {}, "elbow"}};
  joined.locked["elbow"] = {{0.5}, {1e-17}, 2};
  joined.others = {"closing of grip"};
  return {scene::to_text(joined)};
}

void read_run_file(const std::string& bytes) {
  base().restore_finished();
  write_bytes(base().finished() / "run.h5", bytes);
  (void)report::report_json(base().finished());
  scene::export_csv(base().finished(), base() / "run.csv");
  scene::replot(base().finished());
}
Seeds run_file_seeds() { return {base().kept("finished/run.h5")}; }

void read_summary(const std::string& bytes) {
  base().restore_finished();
  write_bytes(base().finished() / "summary.json", bytes);
  try {
    (void)scene::read_report(base().finished(), {});
  } catch (const InvalidArgument&) {
  }
  (void)report::report_json(base().finished());
  scene::replot(base().finished());
}
Seeds summary_seeds() { return {base().kept("finished/summary.json")}; }

}  // namespace

const std::vector<Reader>& readers() {
  static const std::vector<Reader> all{
      {"urdf", read_urdf, urdf_seeds},
      {"scene", read_scene, scene_seeds},
      {"actuator_csv", read_actuator_csv, actuator_csv_seeds},
      {"formula", read_formula, formula_seeds},
      {"ensemble_csv", read_ensemble_csv, ensemble_csv_seeds},
      {"mesh_stl", read_stl, stl_seeds},
      {"mesh_obj", read_obj, obj_seeds},
      {"mesh_dae", read_dae, dae_seeds},
      {"signal_csv", read_signal_csv, signal_csv_seeds},
      {"trajectory_map", read_trajectory_map, trajectory_map_seeds},
      {"trajectory_csv", read_trajectory_csv, trajectory_csv_seeds},
      {"trajectory_h5", read_trajectory_h5, run_file_seeds},
      {"checkpoint", read_checkpoint, checkpoint_seeds},
      {"records", read_records, records_seeds},
      {"cases", read_cases, case_seeds},
      {"joined", read_joined, joined_seeds},
      {"run_file", read_run_file, run_file_seeds},
      {"summary", read_summary, summary_seeds},
  };
  return all;
}

const Reader& reader(const std::string& name) {
  std::string known;
  for (const Reader& r : readers()) {
    if (r.name == name) return r;
    add_to_list(known, r.name);
  }
  throw InvalidArgument("there is no reader '" + name + "', expected one of " + known);
}

bool attempt(const Reader& reader, const std::string& bytes) {
  try {
    reader.read(bytes);
    return false;
  } catch (const InvalidArgument&) {
  } catch (const IoError&) {
  }
  return true;
}

}  // namespace porthos::test::fuzz
