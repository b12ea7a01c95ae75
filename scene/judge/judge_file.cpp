#include "scene/judge/judge_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "mechanics/rotation.h"
#include "phs/error.h"
#include "scene/assemble/centre_of_mass.h"
#include "scene/files/files.h"
#include "scene/judge/trajectory_map.h"
#include "scene/judge/trajectory_table.h"
#include "scene/run/cpu_clock.h"
#include "scene/run/ledger.h"
#include "scene/run/record_log.h"
#include "scene/run/verdict.h"
#include "scene/session/results.h"

namespace porthos::scene {
namespace {

namespace fs = std::filesystem;
using mechanics::JointCoordinates;
using mechanics::Vec3d;
using phs::BlockKind;
using Numbers = std::vector<double>;

double speed_of(const CentreOfMass::Vec& v) { return double(std::sqrt(dot(v, v))); }

/// A model with the works of given torques in its ledger. The torques are known at records only:
/// nothing integrates it.
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

/// The columns of one coordinate: by the map, else by the names Porthos would give them.
class Finder {
 public:
  Finder(const TrajectoryTable& table, const TrajectoryMap& map) : table_(table), map_(map) {}

  std::vector<Numbers> find(const TrajectoryMap::Columns& mapped, const char* kind,
                            const JointCoordinates& c, int numbers) const {
    const auto given = mapped.find(c.name);
    if (given == mapped.end()) {
      for (const auto& name : usual(kind, c.name))
        if (there(name, numbers)) return series(spread(name, numbers));
      return {};
    }
    const std::string key = fmt::format("{}.{}", kind, c.name);
    auto names = given->second;
    if (names.size() == 1 && numbers > 1) names = spread(names[0], numbers);
    if (names.size() != size_t(numbers))
      throw InvalidArgument(fmt::format("{}: columns.{} has {} columns, expected {}",
                                        map_.where.at(key), key, names.size(), numbers));
    return series(names);
  }
  bool has_base() const {
    if (!map_.text.empty()) return map_.q.count("base.position") > 0;
    for (const auto& name : usual("q", "base.position"))
      if (there(name, 3)) return true;
    return false;
  }

 private:
  static std::vector<std::string> usual(const std::string& kind, const std::string& name) {
    if (kind == "q") return {name, "q." + name, "state/" + name};
    if (kind == "p") return {"p." + name, "momentum/" + name};
    return {kind + "." + name, kind + "/" + name};
  }
  static std::vector<std::string> spread(const std::string& name, int numbers) {
    if (numbers == 1) return {name};
    std::vector<std::string> all;
    for (int k = 0; k < numbers; ++k) all.push_back(fmt::format("{}[{}]", name, k));
    return all;
  }
  bool there(const std::string& name, int numbers) const {
    return table_.has(spread(name, numbers)[0]);
  }
  std::vector<Numbers> series(const std::vector<std::string>& names) const {
    std::vector<Numbers> all;
    for (const auto& name : names) all.push_back(table_.column(name));
    return all;
  }

  const TrajectoryTable& table_;
  const TrajectoryMap& map_;
};

Numbers times_of_rows(const TrajectoryTable& table, const TrajectoryMap& map) {
  const std::string name = !map.time.empty() ? map.time : table.has("time") ? "time" : "t";
  Numbers t = table.column(name);
  for (size_t i = 1; i < t.size(); ++i)
    if (!(t[i] > t[i - 1]))
      throw InvalidArgument(fmt::format("{}: '{}' is {} after {}, expected time to go forward",
                                        table.at(i), name, t[i], t[i - 1]));
  return t;
}

/// The distance of the rows; of unequal ones that in the middle.
double middle_step(const Numbers& t) {
  Numbers steps;
  for (size_t i = 1; i < t.size(); ++i) steps.push_back(t[i] - t[i - 1]);
  const double mean = (t.back() - t[0]) / double(steps.size());
  if (std::all_of(steps.begin(), steps.end(),
                  [&](double h) { return std::fabs(h - mean) < 1e-6 * mean; }))
    return mean;
  std::nth_element(steps.begin(), steps.begin() + long(steps.size() / 2), steps.end());
  return steps[steps.size() / 2];
}

/// What a map may name and the model does not have is a mistake.
void require_known_coordinates(const TrajectoryMap& map, const mechanics::Mechanism& m) {
  std::string known;
  for (const auto& c : m.coordinates()) known += (known.empty() ? "" : ", ") + c.name;
  for (const auto& [key, where] : map.where) {
    const std::string name = key.substr(key.find('.') + 1);
    const auto& all = m.coordinates();
    if (std::none_of(all.begin(), all.end(), [&](const auto& c) { return c.name == name; }))
      throw InvalidArgument(fmt::format(
          "{}: columns.{}: the model has no coordinate of this name, expected one of: {}", where,
          key, known));
  }
}

/// A trajectory made elsewhere as states of the model.
class Trajectory {
 public:
  Trajectory(const TrajectoryTable& table, const TrajectoryMap& map, const Assembly& a)
      : table_(table),
        map_(map),
        m_(*a.mechanism),
        model_(*a.mechanical),
        lost_(size_t(m_.angle_count())) {
    require_known_coordinates(map, m_);
    const Finder finder(table, map);
    for (const auto& c : m_.coordinates()) {
      Columns k{c, finder.find(map.q, "q", c, c.nq), {}, {}, {}};
      if (k.q.empty()) missing(c, "q");
      if (map.v.count(c.name) || !map.p.count(c.name)) k.v = finder.find(map.v, "v", c, c.nv);
      if (k.v.empty()) k.p = finder.find(map.p, "p", c, c.nq);
      if (k.v.empty() && k.p.empty()) missing(c, "v");
      by_rates_ |= !k.v.empty();
      by_momenta_ |= !k.p.empty();
      if (k.v.empty())
        k.v.assign(size_t(c.nv), Numbers(table.rows()));  // from the momenta, row by row
      const auto torque = finder.find(map.torque, "torque", c, c.nv);
      if (!torque.empty() && c.nv > 1)
        throw InvalidArgument(fmt::format(
            "{}: torques are given for '{}', which has {} freedoms, expected joints "
            "of one",
            map.path.empty() ? table.at(0) : map.where.at("torque." + c.name), c.name, c.nv));
      if (!torque.empty()) {
        k.torque = torque[0];
        torques_.push_back(c.name);
      }
      columns_.push_back(std::move(k));
    }
    if (by_rates_ && by_momenta_)
      throw InvalidArgument(table.at(0) +
                            ": some joints have rates and others momenta, expected one of both");
  }
  const std::vector<std::string>& torques() const { return torques_; }

  /// A row of the file: as it is, and as it is judged. They differ where the centre of mass is out
  /// (centre_of_mass.h).
  struct Row {
    phs::State world, inner;
    CentreOfMass centre;
  };
  /// h: from the row before [s]. Rows are asked for in their order.
  Row row(const phs::Description& d, size_t i, double h, bool centre_out) {
    Numbers q(size_t(m_.nq())), v(size_t(m_.nv())), p(q.size());
    norm_error_ = 0;
    for (const Columns& k : columns_) {
      for (int n = 0; n < k.c.nq; ++n) q[size_t(k.c.q + n)] = k.q[size_t(n)][i];
      for (int n = 0; n < k.c.nv; ++n) v[size_t(k.c.v + n)] = k.v[size_t(n)][i];
      for (size_t n = 0; n < k.p.size(); ++n) p[size_t(k.c.q) + n] = k.p[n][i];
    }
    Row r;
    if (by_momenta_) {
      auto x = q;
      x.insert(x.end(), p.begin(), p.end());
      v = model_.rates(x, lost_);
      for (Columns& k : columns_)
        for (int n = 0; n < k.c.nv; ++n) k.v[size_t(n)][i] = v[size_t(k.c.v + n)];
    }
    for (const Columns& k : columns_)
      if (k.c.kind == BlockKind::rotation) normalise(&q[size_t(k.c.q)], i);
    if (by_rates_) turn_rates(q, v);
    if (i > 0) follow(i, h);
    r.world = state(d, model_.state(q, v), i);
    if (centre_out) {
      r.centre = take_centre_out(m_, q, v);
      r.inner = state(d, model_.state(q, v), i);
      settle_momentum(m_, r.inner);
    } else {
      r.inner = r.world;
    }
    return r;
  }
  /// Of the attitudes in the file, before they were made unit ones.
  double norm_error() const { return norm_error_; }

  /// Works of the torques from row i - 1 to row i [J].
  void works(size_t i, double h, std::span<double> to) const {
    size_t at = 0;
    for (const Columns& k : columns_) {
      if (k.torque.empty()) continue;
      const double a = k.torque[i - 1], b = k.torque[i], moved = distance(k, i, h);
      to[at] = a * moved;
      if (map_.torque_is_linear) {  // ∫ τ q' over the cubic through both ends and their rates
        const double bend = h / 12 * (k.v[0][i] - k.v[0][i - 1]);
        to[at] = 0.5 * (a + b) * moved + (b - a) * bend;
      }
      ++at;
    }
  }

 private:
  struct Columns {
    JointCoordinates c;
    std::vector<Numbers> q, v, p;
    Numbers torque;
  };
  [[noreturn]] void missing(const JointCoordinates& c, const char* kind) const {
    throw InvalidArgument(fmt::format(
        "{}: no column for {} of '{}', expected '{}{}' or a [columns.{}] in the map",
        map_.path.empty() ? table_.at(0) : map_.path, *kind == 'q' ? "the position" : "the rate",
        c.name, *kind == 'q' ? "" : "v.", c.name, kind));
  }
  void normalise(double* xi, size_t i) {
    const double size = std::sqrt(xi[0] * xi[0] + xi[1] * xi[1] + xi[2] * xi[2] + xi[3] * xi[3]);
    if (!(size > 0.5 && size < 2))
      throw InvalidArgument(fmt::format(
          "{}: the attitude is a quaternion of length {:g}, expected one of 1 (w, x, y, z)",
          table_.at(i), size));
    norm_error_ = std::max(norm_error_, std::fabs(size - 1));
    for (int k = 0; k < 4; ++k) xi[k] /= size;
  }
  /// Rates of free bases into the base's own axes: [angular; linear of its origin].
  void turn_rates(const Numbers& q, Numbers& v) const {
    for (const Columns& k : columns_) {
      if (k.c.kind != BlockKind::rotation) continue;
      const auto R =
          mechanics::rotation_matrix(mechanics::Quaternion<double>::load(&q[size_t(k.c.q)]));
      const auto turn = [&](int at) {
        double* x = &v[size_t(at)];
        const Vec3d local = R.tmul(Vec3d{x[0], x[1], x[2]});
        for (int n = 0; n < 3; ++n) x[n] = local[n];
      };
      if (map_.angular_in_world) turn(k.c.v);
      if (map_.linear_in_body) continue;
      for (const Columns& o : columns_)
        if (o.c.joint == k.c.joint && o.c.nv == 3 && o.c.kind == BlockKind::linear) turn(o.c.v);
    }
  }
  phs::State state(const phs::Description& d, Numbers x, size_t i) const {
    phs::State s(d, std::move(x));
    s.step = std::int64_t(i);
    phs::wrap_angles(d, s);
    for (size_t a = 0; a < lost_.size(); ++a) s.turns[a] += lost_[a];
    return s;
  }
  /// Angles that a file gives modulo 2π go on where they were, as their rates say.
  void follow(size_t i, double h) {
    size_t turn = 0;
    for (const Columns& k : columns_) {
      if (k.c.kind != BlockKind::angle) continue;
      const double step = k.q[0][i] - k.q[0][i - 1];
      lost_[turn++] += std::llround((distance(k, i, h) - step) / phs::two_pi_hi);
    }
  }
  /// How far a joint of one freedom goes from row i - 1 to row i, turns included.
  double distance(const Columns& k, size_t i, double h) const {
    const double step = k.q[0][i] - k.q[0][i - 1];
    if (k.c.kind != BlockKind::angle) return step;
    const double expected = 0.5 * h * (k.v[0][i - 1] + k.v[0][i]);
    return step + phs::two_pi_hi * std::round((expected - step) / phs::two_pi_hi);
  }

  const TrajectoryTable& table_;
  const TrajectoryMap& map_;
  const mechanics::Mechanism& m_;
  const mechanics::MechanicalModel& model_;
  std::vector<Columns> columns_;
  std::vector<std::string> torques_;
  std::vector<std::int64_t> lost_;  ///< turns, by angle
  bool by_rates_ = false, by_momenta_ = false;
  double norm_error_ = 0;
};

/// Powers of the model's own dampers and sources, summed by the trapezoidal rule.
class OwnPowers {
 public:
  explicit OwnPowers(const phs::Model& m)
      : system_(m.instantiate<double>()),
        e_(size_t(m.description().nx)),
        now_(m.description().powers.size()),
        before_(now_.size()) {}
  void works(double t, double h, const phs::State& s, std::span<double> to) {
    std::vector<double> angles;
    for (const auto n : s.turns) angles.push_back(double(n) * phs::two_pi_hi);
    system_->set_turn_angles(angles);
    system_->gradient(s.x, e_);
    system_->powers(t, s.x, e_, now_);
    for (size_t a = 0; a < now_.size(); ++a) to[a] = 0.5 * h * (before_[a] + now_[a]);
    before_ = now_;
  }

 private:
  std::unique_ptr<phs::System<double>> system_;
  Numbers e_, now_, before_;
};

}  // namespace

RunReport judge_file(const JudgeOptions& o) {
  const double cpu = thread_cpu_now();
  const TrajectoryTable table(o.file);
  const TrajectoryMap map = o.map.empty() ? TrajectoryMap{} : read_trajectory_map(o.map);
  const Numbers t = times_of_rows(table, map);
  const double step = middle_step(t);
  Scene scene = scene_of(map, o.model, Finder(table, map).has_base(), step, t.back() - t[0]);
  if (scene.title == fs::path(scene.path).stem())  // none was given
    scene.title = fs::path(o.file).filename().string();
  scene.method = "recorded";

  Assembly a = assemble(scene);
  if (a.model->description().nx != a.mechanical->description().nx)
    throw InvalidArgument(fmt::format(
        "{}: the model has states besides positions and momenta, which a trajectory of q and v "
        "does not tell",
        map.path));
  Trajectory trajectory(table, map, a);
  OwnPowers own(*a.model);
  const size_t powers = a.model->description().powers.size();
  a.model = std::make_shared<const UnderTorques>(a.model, trajectory.torques());
  const phs::Description& d = a.model->description();
  const bool centre_out = a.centre.has_value();
  const auto first = trajectory.row(d, 0, 0, centre_out);
  a.initial = first.inner;

  const fs::path log_path = fs::path(o.out) / "records.bin";
  make_folder(o.out);
  Meter meter(a);
  Ledger ledger(d);
  const RecordLayout layout(d, Extrema::none);
  RunReport r;
  double off_course = 0, fastest = 0;  // of the centre of mass [m/s]
  {
    RecordLog log(log_path, layout);
    Numbers row(layout.size()), works(d.powers.size());
    for (size_t i = 0; i < t.size(); ++i) {
      const double h = i > 0 ? t[i] - t[i - 1] : 0;
      const auto [world, s, centre] = trajectory.row(d, i, h, centre_out);
      own.works(t[i] - t[0], h, s, std::span(works).first(powers));
      if (i > 0) {
        trajectory.works(i, h, std::span(works).subspan(powers));
        ledger.book(works);
      }
      Measured m = meter.measure(s);
      if (!m.finite())
        throw InvalidArgument(table.at(i) + ": the energy of this row is no finite number");
      m.quaternion_norm = trajectory.norm_error();
      const bool regular = i == 0 || std::fabs(h - step) < 1e-6 * step;
      const double error = ledger.add(t[i] - t[0], m, regular);
      fill_record(layout, t[i] - t[0], world, m, ledger.port_work(), error, 0, {}, row);
      log.append(row);
      r.final_state = world;
      const auto fallen = CentreOfMass::Real(t[i] - t[0]) * CentreOfMass::Vec(scene.urdf.gravity);
      off_course = std::max(off_course,
                            speed_of(centre.start_velocity - first.centre.start_velocity - fallen));
      fastest = std::max(
          {fastest, speed_of(centre.start_velocity), m.scale.linear / a.mechanism->total_mass()});
    }
    log.flush();
  }
  r.title = scene.title;
  r.method = scene.method;
  r.step_s = step;
  r.simulated_s = t.back() - t[0];
  r.steps = r.cost.steps = std::int64_t(t.size()) - 1;
  ledger.fill(r, meter);
  r.notes.push_back(
      fmt::format("{} was made elsewhere and judged as it is: {} rows", o.file, t.size()));
  if (powers > 0)
    r.notes.push_back(
        "works of the model's own dampers and sources are taken by the trapezoidal rule between "
        "rows, whose error stands in the defect of the balance");
  integrators::Declaration method;
  method.name = scene.method;
  judge(r, scene, method, meter);
  if (centre_out) {
    r.linear_momentum_error = fastest > 0 ? off_course / fastest : off_course;
    const double limit = scene.verify.linear_momentum.value_or(1e-10);
    r.checks.push_back(
        {"centre_of_mass", r.linear_momentum_error, limit, r.linear_momentum_error <= limit, true});
    a.centre.reset();  // the records are of the world as they are
  }
  r.cpu_s = r.wall_s = thread_cpu_now() - cpu;
  write_results(o.out, scene, a, r, log_path);
  fs::remove(log_path);
  return r;
}

}  // namespace porthos::scene
