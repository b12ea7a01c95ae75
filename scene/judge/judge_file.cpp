#include "scene/judge/judge_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "phs/error.h"
#include "scene/assemble/model_notes.h"
#include "scene/files/digest.h"
#include "scene/files/files.h"
#include "scene/judge/detail/centre_course.h"
#include "scene/judge/detail/hints.h"
#include "scene/judge/detail/rows.h"
#include "scene/judge/detail/turns.h"
#include "scene/judge/detail/work_error.h"
#include "scene/run/cpu_clock.h"
#include "scene/run/ledger.h"
#include "scene/run/record_log.h"
#include "scene/run/verdict.h"
#include "scene/session/results.h"

namespace porthos::scene {
namespace {

namespace fs = std::filesystem;

/// A model with the works of given torques in its ledger. The torques are known only at the
/// records, so it is not integrated.
class UnderTorques : public phs::ModelFor<UnderTorques> {
 public:
  UnderTorques(std::shared_ptr<const phs::Model> model, const std::vector<std::string>& joints)
      : model_(std::move(model)), description_(model_->description()) {
    for (const auto& j : joints)
      description_.powers.push_back({j + ".torque", phs::PowerKind::supplied});
  }
  const phs::Description& description() const override { return description_; }
  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const {
    return model_->instantiate<T>();
  }

 private:
  std::shared_ptr<const phs::Model> model_;
  phs::Description description_;
};

/// Powers of the model's own dampers and sources, summed by the trapezoidal rule.
class OwnPowers {
 public:
  explicit OwnPowers(const phs::Model& m)
      : system_(m.instantiate<double>()),
        description_(m.description()),
        e_(size_t(m.description().nx)),
        now_(m.description().powers.size()),
        before_(now_.size()) {}
  void works(double t, double h, const phs::State& s, std::span<double> to) {
    std::vector<double> angles;
    for (const auto n : s.turns) angles.push_back(double(n) * phs::two_pi_hi);
    system_->set_turn_angles(angles);
    system_->gradient(s.x, e_);
    system_->powers(t, s.x, e_, now_);
    double net = 0;
    for (size_t a = 0; a < now_.size(); ++a) {
      to[a] = 0.5 * h * (before_[a] + now_[a]);
      const auto kind = description_.powers[a].kind;
      if (kind != phs::PowerKind::observed)
        net += kind == phs::PowerKind::supplied ? now_[a] : -now_[a];
    }
    net_.push_back(net);
    before_ = now_;
  }
  /// Their sum at each row [W].
  const Numbers& net() const { return net_; }

 private:
  std::unique_ptr<phs::System<double>> system_;
  phs::Description description_;
  Numbers net_;
  Numbers e_, now_, before_;
};

/// The scene that a trajectory is judged as: its model, without outputs and stops of a run.
Scene recorded_scene(const JudgeOptions& o, const TrajectoryTable& table, const TrajectoryMap& map,
                     double step, double duration) {
  Scene scene = scene_of(map, o.model, has_base(table, map), step, duration);
  if (scene.title == fs::path(scene.path).stem())  // none was given
    scene.title = fs::path(o.file).filename().string();
  scene.digests["trajectory_sha256"] = table.digest();
  if (!map.path.empty()) scene.digests["map_sha256"] = sha256(map.text);
  scene.outputs.clear();
  scene.stops.clear();
  if (scene.verify.energy)  // what is stated for the energy is the accuracy of the data
    for (auto* limit : {&scene.verify.linear_momentum, &scene.verify.angular_momentum,
                        &scene.verify.quaternion_norm})
      if (!*limit) *limit = scene.verify.energy;
  if (scene.is_constrained() && !scene.verify.constraints)
    scene.verify.constraints = scene.verify.energy;
  return scene;
}

/// The model of the trajectory. Its loops are closed near the joints' positions of the first row,
/// so that each has the branch of the trajectory.
Assembly assemble_near_first_row(Scene scene, const TrajectoryTable& table,
                                 const TrajectoryMap& map) {
  const auto& driven = scene.constraints.spec.driven;
  if (!driven.empty())
    throw InvalidArgument(fmt::format(
        "{}: the motion '{}' does work that positions and rates do not tell, expected no "
        "[[motion]] "
        "and the torque of '{}' in [columns.torque]",
        scene.constraints.where.at(driven[0].name), driven[0].name, driven[0].coordinate));
  if (!scene.constraints.empty()) {
    Scene open = scene;
    open.constraints = {};
    const Assembly tree = assemble(open);
    const phs::Description& d = tree.mechanical->description();
    const auto q = phs::with_turns(d, Trajectory(table, map, tree).row(d, 0, 0, false).world);
    for (const auto& c : tree.mechanism->coordinates())
      if (c.nq == 1) scene.joints[c.name].position = q[size_t(c.q)];
  }
  Assembly a = assemble(scene);
  if (a.model->description().nx != a.mechanical->description().nx)
    throw InvalidArgument(fmt::format(
        "{}: the model has states besides positions and momenta, which a trajectory of q and v "
        "does not tell",
        map.path));
  return a;
}

void check_centre(RunReport& r, const Scene& scene, double error) {
  const double limit = scene.verify.linear_momentum.value_or(1e-10);
  r.linear_momentum_error = error;
  r.checks.push_back({"centre_of_mass", error, limit, error <= limit, true});
}

void name_run(RunReport& r, const Scene& scene, const Rows& rows) {
  r.title = scene.title;
  r.method = scene.method;
  r.step_s = rows.step;
  r.simulated_s = rows.t.back() - rows.t[0];
  r.steps = r.cost.steps = std::int64_t(rows.t.size()) - 1;
}

/// The works where rows are missing are not known: their sum is what the energy says.
void close_hole(std::span<double> works, const phs::Description& d, double change) {
  double* last = nullptr;
  bool in = false;
  for (size_t a = 0; a < works.size(); ++a) {
    if (d.powers[a].kind == phs::PowerKind::observed) continue;
    last = &works[a];
    in = d.powers[a].kind == phs::PowerKind::supplied;
    change += in ? -works[a] : works[a];
  }
  if (last) *last += in ? change : -change;
}

/// Errors by row.
struct ErrorsOfRows {
  Numbers energy, linear, angular;  ///< [J], [N s], [N m s]
  void add(double joule, const Measured& m) {
    energy.push_back(joule);
    linear.push_back(std::hypot(m.linear[0], m.linear[1], m.linear[2]));
    angular.push_back(std::hypot(m.angular[0], m.angular[1], m.angular[2]));
  }
};

/// What is in the file, what of it is not used, and what was not stated.
void note_what_is_left(RunReport& r, const JudgeOptions& o, const TrajectoryTable& table,
                       const TrajectoryMap& map, const Scene& scene) {
  r.notes.push_back(
      fmt::format("{} was made elsewhere and judged as it is: {} rows", o.file, table.rows()));
  if (const auto unused = table.unused(); !unused.empty())
    r.notes.push_back(
        fmt::format("columns of {} that were not used: {}", o.file, fmt::join(unused, ", ")));
  if (scene.urdf.base == mechanics::UrdfOptions::Base::fixed)
    for (const auto& name : table.names())
      if (name.starts_with("base.") || name.find("/base.") != name.npos) {
        r.notes.push_back(fmt::format(
            "{} has the column '{}', but the base is judged as fixed: expected [model] base = "
            "\"free\" of the map, if it moves",
            o.file, name));
        break;
      }
  const auto& g = scene.urdf.gravity;
  if (dot(g, g) == 0 && !has_base(table, map))
    r.notes.push_back("judged without gravity: [environment] of the map states it");
}

}  // namespace

RunReport judge_file(const JudgeOptions& o) {
  const double cpu = thread_cpu_now();
  const TrajectoryTable table(o.file);
  const TrajectoryMap map = o.map.empty() ? TrajectoryMap{} : read_trajectory_map(o.map);
  const Numbers t = times_of_rows(table, map);
  const Rows rows(t);
  const Scene scene = recorded_scene(o, table, map, rows.step, t.back() - t[0]);
  Assembly a = assemble_near_first_row(scene, table, map);
  tell_notes(a, o.say);
  Trajectory trajectory(table, map, a);
  OwnPowers own(*a.model);
  const size_t powers = a.model->description().powers.size();
  a.model = std::make_shared<const UnderTorques>(a.model, trajectory.torques());
  const phs::Description& d = a.model->description();
  const bool centre_out = a.centre.has_value();
  a.initial = trajectory.row(d, 0, 0, centre_out).inner;

  const fs::path log_path = fs::path(o.out) / "records.bin";
  make_folder(o.out);
  Meter meter(a);
  Ledger ledger(d);
  const RecordLayout layout(d, Extrema::none);
  RunReport r;
  CentreCourse course;
  const CentreOfMass::Vec gravity(scene.urdf.gravity);
  const double mass = a.mechanism->total_mass();
  ErrorsOfRows errors;
  {
    RecordLog log(log_path, layout);
    const Numbers unknown(layout.reactions, NAN);  // a trajectory of q and v does not tell them
    Numbers row(layout.size()), works(d.powers.size());
    long double before_J = 0;  // of the row before
    for (size_t i = 0; i < t.size(); ++i) {
      const double h = i > 0 ? t[i] - t[i - 1] : 0;
      const auto [world, s, centre] = trajectory.row(d, i, h, centre_out);
      own.works(t[i] - t[0], h, s, std::span(works).first(powers));
      Measured m = meter.measure(t[i], s);
      if (!m.finite())
        throw InvalidArgument(table.at(i) + ": the energy of this row is no finite number");
      if (i > 0) {
        trajectory.works(t, i, std::span(works).subspan(powers));
        if (rows.is_hole(i)) close_hole(works, d, double(m.energy_change_J - before_J));
        ledger.book(works);
      }
      before_J = m.energy_change_J;
      m.quaternion_norm = trajectory.norm_error();
      const double error = ledger.add(t[i] - t[0], m, true);
      const auto pushed = course.add(t[i] - t[0], centre, m.scale.linear, gravity, mass);
      if (centre_out) m.linear = pushed;
      errors.add(error, m);
      fill_record(layout, t[i] - t[0], world, m, ledger.port_work(), error, 0, unknown, {}, {},
                  row);
      log.append(row);
      r.final_state = world;
    }
    log.flush();
  }
  name_run(r, scene, rows);
  ledger.fill(r, meter);
  note_what_is_left(r, o, table, map, scene);
  tell_of_rows(r, rows, errors.energy);
  integrators::Declaration method;
  method.name = scene.method;
  judge(r, scene, method, meter);
  judge_works(r, trajectory, map.torque_between, {rows, own.net(), errors.energy});
  if (centre_out) check_centre(r, scene, course.error());
  a.centre.reset();  // the records are in the world frame
  judge_turns(r, trajectory, rows, *a.model, r.final_state);
  note_one_row(r, rows, errors.energy);
  tell_of_momentum(r, rows, centre_out ? "centre_of_mass" : "linear_momentum", errors.linear);
  tell_of_momentum(r, rows, "angular_momentum", errors.angular);
  const RatesAgreement rates = trajectory.agreement(rows);
  check_rates(r, rates, rows);
  const bool asked =
      !r.passed() && ask_about_columns(r, trajectory, {rows, d, meter, centre_out, gravity, mass});
  note_rates(r, rates, rows, asked);
  r.cpu_s = r.wall_s = thread_cpu_now() - cpu;
  write_results(o.out, scene, a, r, log_path);
  fs::remove(log_path);
  return r;
}

}  // namespace porthos::scene
